"""`hi5 card`: files beside a download that say what it is, and are right about it."""

import hashlib
import json
from pathlib import Path

import pytest
from mlcroissant import GenerationError

from hi5_common.cli.fetch import download
from hi5_common.cli.fetch.card import write_card
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.records import Gap
from hi5_common.domain.rights import Rights
from hi5_common.export.label_table import read_label_table
from tests.support.croissant import records
from tests.unit.cli.command import Command
from tests.unit.cli.published import PublishedDataset, published


def carded(dataset: PublishedDataset, root: Path) -> None:
    download.fetch_shards(dataset, download.published(dataset), root)
    write_card(dataset, root, None)


def test_labels_are_read_through_the_croissant_file(tmp_path: Path) -> None:
    dataset = published(5)
    carded(dataset, tmp_path)
    rows = records(tmp_path / "croissant.json", "labels_records", 9)
    labels = [
        label
        for number in range(3)
        for label in read_label_table(tmp_path / f"shards/00000{number}/labels.parquet")
    ]
    assert [row["labels_records/index"] for row in rows] == [0, 1, 2, 3, 4]
    for row, label in zip(rows, labels, strict=True):
        assert (
            row["labels_records/pose"].decode()
            == label.attributes[next(name for name in label.attributes if name.value == "pose")]
        )
        assert label.keypoints is not None
        assert row["labels_records/keypoints_image_px"] == [
            list(point.image_px or ()) for point in label.keypoints
        ]
        assert label.mask is not None
        assert row["labels_records/mask_counts"].decode() == label.mask.counts


def test_checksums_are_those_of_the_files_and_their_own_stands_in_croissant(
    tmp_path: Path,
) -> None:
    carded(published(5), tmp_path)
    text = (tmp_path / "SHA256SUMS").read_bytes()
    for line in text.decode().splitlines():
        sha256, name = line.split("  ")
        assert hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() == sha256
    files = json.loads((tmp_path / "croissant.json").read_text("utf-8"))["distribution"]
    assert len(text.splitlines()) == 9
    assert files[0]["sha256"] == hashlib.sha256(text).hexdigest()
    for file in files[1:10]:
        content = (tmp_path / file["contentUrl"]).read_bytes()
        assert hashlib.sha256(content).hexdigest() == file["sha256"]


def test_a_file_that_was_changed_is_not_read(tmp_path: Path) -> None:
    carded(published(2), tmp_path)
    sums = tmp_path / "SHA256SUMS"
    sums.write_bytes(sums.read_bytes() + b"\n")
    document = json.loads((tmp_path / "croissant.json").read_text("utf-8"))
    document["recordSet"] = [
        {
            "@type": "cr:RecordSet",
            "@id": "sums",
            "name": "sums",
            "field": [
                {
                    "@type": "cr:Field",
                    "@id": "sums/text",
                    "name": "text",
                    "dataType": "sc:Text",
                    "source": {
                        "fileObject": {"@id": "SHA256SUMS"},
                        "extract": {"fileProperty": "content"},
                    },
                }
            ],
        }
    ]
    (tmp_path / "changed.json").write_text(json.dumps(document), "utf-8")
    with pytest.raises(GenerationError) as refused:
        records(tmp_path / "changed.json", "sums", 1)
    assert "is not identical with the reference" in str(refused.value.__cause__)


def test_gaps_of_the_manifest_are_named(tmp_path: Path) -> None:
    dataset = published(5)
    gap = Gap(4, "failed 5 times: it broke")
    dataset.rows[2] = dataset.rows[2].model_copy(update={"gaps": (gap,)})
    carded(dataset, tmp_path)
    text = (tmp_path / "README.md").read_text("utf-8")
    assert "1 of 5 images could not be made" in text
    assert "- image 4: failed 5 times: it broke" in text


def test_licences_are_the_rights_of_the_dataset(tmp_path: Path) -> None:
    dataset = published(2)
    carded(dataset, tmp_path)
    found = Rights.model_validate_json((tmp_path / "licences.json").read_text("utf-8"))
    assert found == dataset.rights()


def test_a_card_is_written_over_a_card_but_not_over_somebodys_readme(tmp_path: Path) -> None:
    dataset = published(2)
    carded(dataset, tmp_path)
    carded(dataset, tmp_path)
    (tmp_path / "README.md").write_text("# My own notes\n", "utf-8")
    with pytest.raises(InvalidInput, match="would be lost"):
        write_card(dataset, tmp_path, None)
    assert (tmp_path / "README.md").read_text("utf-8") == "# My own notes\n"


@pytest.mark.parametrize("creator", ["", " ", "x" * 201])
def test_a_creator_has_a_name(hi5: Command, tmp_path: Path, creator: str) -> None:
    identity = "00000000-0000-0000-0000-000000000007"
    answer = hi5("card", identity, "--out", tmp_path, "--creator", creator)
    assert answer.code == 2
    assert "--creator" in answer.err
