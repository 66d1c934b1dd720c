"""What is packed can be found again, byte for byte."""

import hashlib
import json
import tarfile
from pathlib import Path

import pytest

from hi5_common.domain import keys
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.vocabulary import ALWAYS_BALANCED
from hi5_common.export.label_table import read_label_table
from services.worker.fleet.attempt_errors import AttemptFailed
from services.worker.fleet.pack import PackedShard, pack
from services.worker.fleet.shard_render import RenderedImage
from tests.unit.export.factories import label


def rendered(folder: Path, index: int) -> RenderedImage:
    folder.mkdir(exist_ok=True)
    image, text = b"\xff\xd8" + bytes([index]) * 1000, label(index).model_dump_json().encode()
    paths = folder / f"{index:09d}.jpg", folder / f"{index:09d}.json"
    for path, data in zip(paths, (image, text), strict=True):
        path.write_bytes(data)
    sums = [hashlib.sha256(data).hexdigest() for data in (image, text)]
    return RenderedImage(index, *paths, *sums)


def packed(folder: Path) -> PackedShard:
    folder.mkdir()
    return pack([rendered(folder / "images", index) for index in range(3)], folder, ALWAYS_BALANCED)


def test_members_are_byte_ranges_of_the_tar(tmp_path: Path) -> None:
    made = packed(tmp_path / "a")
    data = made.samples.path.read_bytes()
    members = json.loads(made.members.path.read_text("utf-8"))["members"]
    assert [m["name"] for m in members][:3] == ["000000000.jpg", "000000000.json", "000000001.jpg"]
    for member in members:
        part = data[member["offset"] : member["offset"] + member["size"]]
        assert hashlib.sha256(part).hexdigest() == member["sha256"]


def test_the_tar_is_a_tar(tmp_path: Path) -> None:
    made = packed(tmp_path / "a")
    with tarfile.open(made.samples.path) as tar:
        headers = tar.getmembers()
    assert len(headers) == 6
    assert {(h.mtime, h.uid, h.gid, h.mode, h.uname) for h in headers} == {(0, 0, 0, 0o644, "")}


def test_labels_and_tallies(tmp_path: Path) -> None:
    made = packed(tmp_path / "a")
    assert list(read_label_table(made.labels.path)) == [label(index) for index in range(3)]
    assert made.image_count == 3
    assert made.tallies.values["pose=rocker"] == 3
    assert made.tallies.pairs["gender=female&pose=rocker"] == 3


def test_the_same_images_give_the_same_bytes(tmp_path: Path) -> None:
    first, second = packed(tmp_path / "a"), packed(tmp_path / "b")
    for name in ("samples", "labels", "members"):
        assert getattr(first, name).sha256 == getattr(second, name).sha256


def test_a_file_that_changed_is_not_packed(tmp_path: Path) -> None:
    image = rendered(tmp_path / "images", 0)
    image.image_path.write_bytes(b"\xff\xd8 other")
    with pytest.raises(AttemptFailed, match=r"000000000.jpg changed"):
        pack([image], tmp_path, ALWAYS_BALANCED)


@pytest.mark.parametrize("name", [keys.SAMPLES, keys.LABELS, keys.MEMBERS])
def test_a_full_disk_is_the_workers_trouble_and_is_told(tmp_path: Path, name: str) -> None:
    """Whatever is written to /dev/full finds no room."""
    (tmp_path / name).symlink_to("/dev/full")
    image = rendered(tmp_path / "images", 0)
    with pytest.raises(AttemptFailed, match=r"no space left below .* MB .*HI5_SCRATCH_DIR") as told:
        pack([image], tmp_path, ALWAYS_BALANCED)
    assert told.value.kind is FailureKind.DISK_FULL
