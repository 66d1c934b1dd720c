"""Every kind of damage is found, and named for what it is."""

import hashlib
import json
from collections.abc import Callable
from typing import Any

import pytest

from hi5_common.cli.fetch.audit import AuditReport, Fault, audit
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import ShardStatus
from hi5_common.domain.sharding import ShardRange
from tests.unit.cli.published import PublishedDataset, add_shard, published


def report_of(dataset: PublishedDataset) -> AuditReport:
    *_, report = audit(dataset)
    assert isinstance(report, AuditReport)
    return report


def test_a_sound_dataset_has_no_findings() -> None:
    report = report_of(published(5))
    assert report.findings == ()
    assert (report.images, report.published, report.unpublished) == (5, 5, 0)
    assert report.objects == 9


def test_what_is_not_rendered_yet_is_no_fault() -> None:
    dataset = published(5)
    pending = dataset.rows[1].model_copy(update={"status": ShardStatus.PENDING, "objects": ()})
    dataset.rows[1] = pending
    report = report_of(dataset)
    assert report.findings == ()
    assert report.unpublished == 2


def lose_a_shard_row(dataset: PublishedDataset) -> None:
    del dataset.rows[1]


def double_a_shard_row(dataset: PublishedDataset) -> None:
    dataset.rows.append(dataset.rows[1])


def lose_an_object(dataset: PublishedDataset) -> None:
    del dataset.objects[dataset.rows[0].objects[1].key]


def flip_a_bit(dataset: PublishedDataset) -> None:
    key = dataset.rows[2].objects[0].key
    content = bytearray(dataset.objects[key])
    content[600] ^= 1
    dataset.objects[key] = bytes(content)


def cut_an_object(dataset: PublishedDataset) -> None:
    key = dataset.rows[0].objects[0].key
    dataset.objects[key] = dataset.objects[key][:-512]


def republish(dataset: PublishedDataset, indices: list[int]) -> None:
    """Publish shard 0 again, with other images than its range says."""
    del dataset.rows[0]
    add_shard(dataset, Plan.of(dataset.made_spec), ShardRange(0, 0, 2), indices)


def forget_an_image(dataset: PublishedDataset) -> None:
    republish(dataset, [0])


def pack_an_image_twice(dataset: PublishedDataset) -> None:
    republish(dataset, [0, 1, 1])


def pack_another_shards_image(dataset: PublishedDataset) -> None:
    republish(dataset, [0, 1, 4])


def change_a_tally(dataset: PublishedDataset) -> None:
    tallies = dataset.rows[0].tallies
    changed = {name: count + 1 for name, count in tallies.items()}
    dataset.rows[0] = dataset.rows[0].model_copy(update={"tallies": changed})


def replace_object(dataset: PublishedDataset, number: int, content: bytes) -> None:
    """Publish other bytes as an object of shard 0, with a row that agrees with them."""
    row = dataset.rows[0]
    item = row.objects[number]
    digest = hashlib.sha256(content).hexdigest()
    dataset.objects[item.key] = content
    swapped = item.model_copy(update={"size_bytes": len(content), "sha256": digest})
    objects = tuple(swapped if other == item else other for other in row.objects)
    dataset.rows[0] = row.model_copy(update={"objects": objects})


def misplace_a_member(dataset: PublishedDataset) -> None:
    members = dataset.objects[dataset.rows[0].objects[2].key]
    replace_object(dataset, 2, members.replace(b'"offset":512', b'"offset":513', 1))


def let_table_and_json_differ(dataset: PublishedDataset) -> None:
    tar = dataset.objects[dataset.rows[0].objects[0].key]
    changed = tar.replace(b'"in_frame_share":0.875', b'"in_frame_share":0.876', 1)
    replace_object(dataset, 0, changed)
    document = json.loads(dataset.objects[dataset.rows[0].objects[2].key])
    for member in document["members"]:
        content = changed[member["offset"] : member["offset"] + member["size"]]
        member["sha256"] = hashlib.sha256(content).hexdigest()
    replace_object(dataset, 2, json.dumps(document).encode())


def swap_the_plan(dataset: PublishedDataset) -> None:
    dataset.made_spec = dataset.made_spec.model_copy(update={"seed": 99})


@pytest.mark.parametrize(
    ("damage", "fault"),
    [
        (lose_a_shard_row, Fault.MISSING),
        (double_a_shard_row, Fault.DOUBLE),
        (lose_an_object, Fault.MISSING),
        (flip_a_bit, Fault.WRONG_BYTES),
        (cut_an_object, Fault.WRONG_BYTES),
        (forget_an_image, Fault.MISSING),
        (pack_an_image_twice, Fault.DOUBLE),
        (pack_another_shards_image, Fault.UNEXPECTED),
        (change_a_tally, Fault.WRONG_TALLY),
        (swap_the_plan, Fault.WRONG_LABEL),
        (misplace_a_member, Fault.WRONG_BYTES),
        (let_table_and_json_differ, Fault.WRONG_LABEL),
    ],
)
def test_damage_is_found(damage: Callable[[PublishedDataset], None], fault: Fault) -> None:
    dataset = published(5)
    damage(dataset)
    report = report_of(dataset)
    assert report.count(fault) > 0
    assert all(finding.fault is fault for finding in report.findings) or fault in {
        Fault.MISSING,
        Fault.DOUBLE,
        Fault.UNEXPECTED,
    }


GROUPED: dict[str, Any] = {
    "twins": ["gender"],
    "splits": {"by": "identity", "images": {"test": 2, "train": 4}},
}


def test_splits_and_twins_as_planned_are_no_finding() -> None:
    assert report_of(published(6, **GROUPED)).findings == ()


@pytest.mark.parametrize(("left_out", "wrong"), [("splits", "split"), ("twins", "twin_group")])
@pytest.mark.parametrize("planned", [True, False])
def test_a_wrong_split_or_twin_group_is_found(left_out: str, wrong: str, planned: bool) -> None:
    without = {name: value for name, value in GROUPED.items() if name != left_out}
    labels_of, plan_of = (without, GROUPED) if planned else (GROUPED, without)
    dataset = published(6, **labels_of)
    dataset.made_spec = published(6, **plan_of).made_spec
    found = report_of(dataset).findings
    assert {finding.fault for finding in found} == {Fault.WRONG_LABEL}
    assert len(found) == 6
    assert all(wrong in finding.detail for finding in found)


@pytest.mark.parametrize(
    ("indices", "fault", "name"),
    [
        ([0], Fault.MISSING, "000000001.jpg"),
        ([0, 1, 1], Fault.DOUBLE, "000000001.json"),
        ([0, 1, 4], Fault.UNEXPECTED, "000000004.jpg"),
    ],
)
def test_the_file_in_the_tar_is_named(indices: list[int], fault: Fault, name: str) -> None:
    dataset = published(5)
    republish(dataset, indices)
    found = [(finding.fault, finding.subject) for finding in report_of(dataset).findings]
    assert (fault, name) in found


def test_an_object_that_is_whole_but_no_table_is_found() -> None:
    dataset = published(2)
    replace_object(dataset, 1, b"not parquet")
    (finding,) = report_of(dataset).findings
    assert finding.fault is Fault.WRONG_BYTES
    assert "not a Parquet file" in finding.detail
