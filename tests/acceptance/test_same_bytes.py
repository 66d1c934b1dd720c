"""An image is a function of (spec, seed, index): not of shards, workers or services."""

import json
import tarfile
from pathlib import Path

import pytest

from tests.acceptance.machine import hi5, machine, write_spec

pytestmark = [pytest.mark.acceptance, pytest.mark.slow, pytest.mark.render]

COUNT = 6


def members(folder: Path) -> dict[str, bytes]:
    """Return every image and label of a download by name."""
    found: dict[str, bytes] = {}
    for path in sorted(folder.glob("shards/*/samples.tar")):
        with tarfile.open(path) as tar:
            for item in tar:
                content = tar.extractfile(item)
                assert content is not None
                found[item.name] = content.read()
    return found


def rendered(tmp_path: Path, name: str, images_per_shard: int, workers: int) -> Path:
    """Render the same images in shards of a size by a number of workers; return the download."""
    spec = write_spec(
        tmp_path / f"{name}.yaml", name="same", count=COUNT, images_per_shard=images_per_shard
    )
    with machine(tmp_path / name, workers=workers) as stack:
        dataset_id = stack.hi5("submit", spec, "--wait", "--json").json()["id"]
        stack.hi5("download", dataset_id, "--out", tmp_path / f"{name}-out", "--images")
    return tmp_path / f"{name}-out"


def test_shard_size_workers_and_services_change_no_byte(tmp_path: Path) -> None:
    whole = rendered(tmp_path, "whole", COUNT, workers=1)
    cut = rendered(tmp_path, "cut", 2, workers=2)
    assert len(list(cut.glob("shards/*"))) == 3
    assert members(whole) == members(cut)
    assert len(members(whole)) == 2 * COUNT
    assert (whole / "labels.parquet").read_bytes() == (cut / "labels.parquet").read_bytes()

    alone = tmp_path / "alone"
    hi5("render", tmp_path / "cut.yaml", "--out", alone, "--index", "4")
    (image,) = (alone / "images").iterdir()
    assert image.read_bytes() == members(cut)[image.name]
    (annotation,) = json.loads((alone / "coco.json").read_text())["annotations"]
    downloaded = json.loads((cut / "coco.json").read_text())["annotations"]
    assert annotation == downloaded[4]
