"""An export is of images that there are, into the file that was named."""

import json
from collections.abc import Iterable
from pathlib import Path

import pytest

from hi5_common.cli.fetch import download
from hi5_common.domain.labels import ImageLabel
from hi5_common.export.label_table import write_label_table
from tests.unit.cli.command import Command
from tests.unit.export import factories

SPLIT = {"splits": {"by": "identity", "images": {"test": 1, "train": 2}}}


def downloaded(folder: Path, labels: Iterable[ImageLabel], **spec: object) -> Path:
    """Return a folder with what an export reads."""
    folder.mkdir()
    (folder / download.SPEC).write_text(json.dumps({"count": 3, **spec}), encoding="utf-8")
    write_label_table(folder / download.LABELS, labels)
    return folder


def labels(*splits: str | None) -> list[ImageLabel]:
    return [factories.label(index, split=split) for index, split in enumerate(splits)]


def test_a_split_is_written_into_a_new_folder(hi5: Command, tmp_path: Path) -> None:
    source = downloaded(tmp_path / "in", labels("test", "train", "train"), **SPLIT)
    out = tmp_path / "new" / "coco.json"
    finished = hi5("export", "coco", "--from", source, "--out", out, "--split", "train")
    assert (finished.code, "2 images" in finished.err) == (0, True)
    assert [image["id"] for image in json.loads(out.read_text())["images"]] == [1, 2]


@pytest.mark.parametrize(
    ("found", "spec", "split", "named"),
    [
        (labels("test", "test"), SPLIT, ["--split", "tset"], "--split: tset"),
        (labels("test", "test"), {}, ["--split", "test"], "--split: test"),
        (labels(None, None), SPLIT, ["--split", "test"], "--split: test"),
        (labels(), {}, [], "--from: "),
    ],
    ids=["unknown split", "not split", "labels without splits", "no labels"],
)
def test_an_export_of_no_image_is_refused_and_leaves_nothing(
    hi5: Command,
    tmp_path: Path,
    found: list[ImageLabel],
    spec: dict[str, object],
    split: list[str],
    named: str,
) -> None:
    source = downloaded(tmp_path / "in", found, **spec)
    out = tmp_path / "new" / "coco.json"
    finished = hi5("export", "coco", "--from", source, "--out", out, *split)
    assert finished.code == 2
    assert named in finished.err
    assert not out.parent.exists()


def test_a_folder_is_no_file_to_write(hi5: Command, tmp_path: Path) -> None:
    source = downloaded(tmp_path / "in", labels(None))
    finished = hi5("export", "coco", "--from", source, "--out", tmp_path)
    assert finished.code == 2
    assert f"--out: {tmp_path}" in " ".join(finished.err.split())
    assert "Traceback" not in finished.err
