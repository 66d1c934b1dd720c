"""What the manifest says of rows."""

from datetime import UTC, datetime
from uuid import UUID

from hi5_common.domain.manifest import Manifest, manifest_shard, progress_of
from hi5_common.domain.records import (
    Dataset,
    DatasetStatus,
    Publication,
    Shard,
    ShardStatus,
    StoredObject,
    Tallies,
)
from hi5_common.domain.spec import parse_spec

ID = UUID("01890000-0000-7000-8000-000000000000")
CREATED = datetime(2026, 11, 22, tzinfo=UTC)
SAMPLES, LABELS, MEMBERS = (
    StoredObject(f"key/{name}", size, str(size) * 64)
    for name, size in (("samples.tar", 3), ("labels.parquet", 2), ("members.json", 1))
)
PUBLICATION = Publication(SAMPLES, LABELS, MEMBERS, 4, Tallies({"gender=male": 4}, {"x": 1}))


def shard(publication: Publication | None) -> Shard:
    status = ShardStatus.DONE if publication else ShardStatus.FAILED
    reason = None if publication else "image: it broke"
    return Shard(ID, ID, 7, 28, 32, status, 2, 4, None, None, reason, publication)


def test_a_published_shard_names_its_objects_by_key_size_and_hash() -> None:
    shown = manifest_shard(shard(PUBLICATION))
    assert [(item.name, item.key) for item in shown.objects] == [
        ("samples.tar", "key/samples.tar"),
        ("labels.parquet", "key/labels.parquet"),
        ("members.json", "key/members.json"),
    ]
    assert [item.size_bytes for item in shown.objects] == [3, 2, 1]
    assert [item.sha256[:1] for item in shown.objects] == ["3", "2", "1"]
    assert shown.tallies == {"gender=male": 4}
    assert (shown.number, shown.start, shown.stop, shown.attempt) == (7, 28, 32, 2)


def test_a_failed_shard_has_a_reason_and_nothing_else() -> None:
    shown = manifest_shard(shard(None))
    assert (shown.status, shown.failure_reason) == ("failed", "image: it broke")
    assert shown.objects == ()
    assert shown.tallies == {}


def test_progress_counts_every_status_also_those_with_no_shard() -> None:
    spec = parse_spec({"count": 40})
    status = DatasetStatus.RUNNING
    dataset = Dataset(ID, spec, CREATED, None, status, {ShardStatus.DONE: 3}, 10, 5, 2)
    progress = progress_of(dataset)
    assert (progress.count, progress.done, progress.in_progress) == (40, 10, 5)
    assert progress.missing == 2
    assert progress.shards == dict.fromkeys(ShardStatus, 0) | {ShardStatus.DONE: 3}


def test_a_manifest_survives_the_way_over_the_wire() -> None:
    spec = parse_spec({"count": 40, "attributes": {"gender": {"male": 40}}})
    dataset = Dataset(ID, spec, CREATED, None, DatasetStatus.RUNNING, {}, 0, 0)
    manifest = Manifest(
        dataset_id=ID,
        status=dataset.status,
        created_at=CREATED,
        spec=spec,
        progress=progress_of(dataset),
        tallies={"gender=male": 4},
        shards=(manifest_shard(shard(PUBLICATION)), manifest_shard(shard(None))),
        next="/v1/more",
    )
    assert Manifest.model_validate_json(manifest.model_dump_json()) == manifest
