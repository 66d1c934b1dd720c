"""A user's own panoramas: what is taken in, and what is refused in which words."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from hi5_common.domain.environments import EnvironmentKind
from hi5_common.domain.errors import InvalidInput
from hi5_common.own_places import list_own
from services.worker.places.errors import MissingAsset
from services.worker.places.exr import read_panorama, write_panorama
from services.worker.places.intake import MAX_WIDTH_PX, Terms, add_folder
from services.worker.places.panoramas import own_path

TERMS = Terms(EnvironmentKind.INDOOR, "CC-BY-4.0", "A Test")
GREY = np.full((32, 64, 3), 0.5, dtype=np.float32)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "mine"
    path.mkdir()
    return path


def write_hdr(path: Path, pixels: np.ndarray) -> None:
    assert cv2.imwrite(str(path), pixels[..., ::-1])


def test_exr_and_hdr_are_taken_in_with_their_terms(folder: Path, tmp_path: Path) -> None:
    write_panorama(folder / "my room.exr", GREY)
    write_hdr(folder / "hall.hdr", GREY * 4.0)
    added = add_folder(folder, tmp_path / "assets", TERMS)
    assert [panorama.entry.id for panorama in added] == ["user:hall", "user:my-room"]
    assert list_own(tmp_path / "assets") == added
    assert [panorama.entry.luminance for panorama in added] == pytest.approx([2.0, 0.5], rel=0.01)
    assert {panorama.entry.licence for panorama in added} == {"CC-BY-4.0"}
    read = read_panorama(own_path(tmp_path / "assets", "user:hall"))
    assert read.shape == (32, 64, 3)
    assert np.allclose(read, 2.0, rtol=0.01)


def refusal(folder: Path, assets: Path) -> str:
    with pytest.raises(InvalidInput) as caught:
        add_folder(folder, assets, TERMS)
    assert list_own(assets) == []
    return str(caught.value)


def test_a_wrong_file_refuses_the_whole_folder(folder: Path, tmp_path: Path) -> None:
    write_panorama(folder / "good.exr", GREY)
    (folder / "text.exr").write_bytes(b"no picture at all")
    (folder / "text.hdr").write_bytes(b"no picture at all")
    write_panorama(folder / "square.exr", GREY[:, :32])
    bad = GREY.copy()
    bad[3, 4, 1] = np.nan
    write_panorama(folder / "nan.exr", bad)
    write_panorama(folder / "black.exr", GREY * 0.0)
    said = refusal(folder, tmp_path / "assets")
    assert said.count("is not valid") == 5
    for words in ("text.exr", "text.hdr", "32 x 32", "not numbers", "It is black"):
        assert words in said


def test_the_size_is_refused_by_the_header_alone(folder: Path, tmp_path: Path) -> None:
    size = MAX_WIDTH_PX + 2
    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {size // 2} +X {size}\n"
    (folder / "huge.hdr").write_bytes(header.encode() + bytes(1 << 20))
    assert f"It is {size} wide" in refusal(folder, tmp_path / "assets")


def test_an_empty_folder_and_twins_are_told(folder: Path, tmp_path: Path) -> None:
    assert "holds .exr or .hdr files" in refusal(folder, tmp_path / "assets")
    write_panorama(folder / "a b.exr", GREY)
    write_panorama(folder / "a-b.exr", GREY)
    assert "rename one" in refusal(folder, tmp_path / "assets")


def test_a_panorama_that_was_never_added_names_the_remedy(tmp_path: Path) -> None:
    with pytest.raises(MissingAsset, match="hi5 assets add FOLDER"):
        own_path(tmp_path, "user:none")
    with pytest.raises(MissingAsset, match="hi5 assets fetch some_id"):
        own_path(tmp_path, "polyhaven:some_id")
