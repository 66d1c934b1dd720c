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


def spec_in_shards_of(tmp_path: Path, images_per_shard: int) -> Path:
    return write_spec(
        tmp_path / f"{images_per_shard}.yaml",
        name="same",
        count=COUNT,
        images_per_shard=images_per_shard,
    )


def test_shard_size_workers_and_services_change_no_byte(tmp_path: Path) -> None:
    in_one, in_three = (spec_in_shards_of(tmp_path, size) for size in (COUNT, 2))
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    with machine(tmp_path / "up", workers=2) as stack:
        submitted = [(stack.submit(spec), out) for spec, out in ((in_one, whole), (in_three, cut))]
        for dataset_id, out in submitted:
            stack.hi5("watch", str(dataset_id))
            stack.hi5("download", str(dataset_id), "--out", out, "--images")
    assert len(list(cut.glob("shards/*"))) == 3
    assert members(whole) == members(cut)
    assert len(members(whole)) == 2 * COUNT
    assert (whole / "labels.parquet").read_bytes() == (cut / "labels.parquet").read_bytes()

    alone = tmp_path / "alone"
    hi5("render", in_three, "--out", alone, "--index", "4")
    (image,) = (alone / "images").iterdir()
    assert image.read_bytes() == members(cut)[image.name]
    (annotation,) = json.loads((alone / "coco.json").read_text())["annotations"]
    downloaded = json.loads((cut / "coco.json").read_text())["annotations"]
    assert annotation == downloaded[4]
