"""Every command against a running service, with the fake renderer."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from hi5_common.settings import RendererName
from tests.acceptance.machine import Machine, hi5, machine, write_spec
from tests.support.croissant import records

pytestmark = [pytest.mark.acceptance, pytest.mark.slow]

COUNT = 7
READ_BY_ADDRESS = """
import json, sys
import mlcroissant
rows = list(mlcroissant.Dataset(jsonld=sys.argv[1]).records("pictures_records"))
assert all(min(row["pictures_records/picture"].size) >= 16 for row in rows)
print(json.dumps(sorted(row["pictures_records/file_name"].decode() for row in rows)))
"""


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machine]:
    folder = tmp_path_factory.mktemp("commands")
    with machine(folder / "data", workers=1, renderer=RendererName.FAKE) as running:
        yield running


@pytest.fixture(scope="module")
def dataset_id(stack: Machine) -> str:
    spec = write_spec(stack.data_dir / "s.yaml", count=COUNT, images_per_shard=3, name="few")
    answer = stack.hi5("submit", spec, "--wait", "--json", "--idempotency-key", "once").json()
    assert answer["status"] == "complete"
    again = stack.hi5("submit", spec, "--idempotency-key", "once")
    assert again.out.strip() == answer["id"]
    return str(answer["id"])


def test_a_dataset_is_listed_watched_and_described(stack: Machine, dataset_id: str) -> None:
    (listed,) = [item for item in stack.hi5("list", "--json").json() if item["name"] == "few"]
    assert listed["id"] == dataset_id
    assert dataset_id in stack.hi5("list").out
    lines = stack.hi5("watch", dataset_id, "--json").out.splitlines()
    assert json.loads(lines[-1])["progress"]["done"] == COUNT
    manifest = stack.hi5("manifest", dataset_id, "--json").json()
    assert [shard["stop"] for shard in manifest["shards"]] == [3, 6, 7]
    assert "labels.parquet" in stack.hi5("manifest", dataset_id).out


def test_the_balance_is_as_planned(stack: Machine, dataset_id: str) -> None:
    balance = stack.hi5("balance", dataset_id, "--json").json()
    assert balance["delivered"] == COUNT
    assert balance["worst_delivered_deviation"] == 0
    assert "very_light" in stack.hi5("balance", dataset_id).out


def test_the_card_of_a_download_is_read_by_croissants_own_library(
    stack: Machine, dataset_id: str, tmp_path: Path
) -> None:
    stack.hi5("download", dataset_id, "--out", tmp_path)
    answer = stack.hi5("card", dataset_id, "--out", tmp_path, "--creator", "A Test")
    assert answer.out.startswith("commercial use: Yes")
    assert "made by | A Test" in (tmp_path / "README.md").read_text("utf-8")
    labels = records(tmp_path / "croissant.json", "labels_records", COUNT + 1)
    assert [row["labels_records/index"] for row in labels] == list(range(COUNT))
    pictures = records(tmp_path / "croissant.json", "pictures_records", COUNT + 1)
    names = [row["labels_records/file_name"] for row in labels]
    assert [row["pictures_records/file_name"] for row in pictures] == names
    size = (labels[0]["labels_records/width_px"], labels[0]["labels_records/height_px"])
    assert {row["pictures_records/picture"].size for row in pictures} == {size}
    here = ("--data-dir", stack.data_dir)
    direct = stack.hi5("card", dataset_id, "--out", tmp_path / "direct", "--direct", *here)
    assert direct.out == answer.out


def test_pictures_are_read_by_address(stack: Machine, dataset_id: str, tmp_path: Path) -> None:
    address = f"{stack.url}/v1/datasets/{dataset_id}/croissant"
    netrc = tmp_path / "netrc"
    netrc.write_text(f"machine 127.0.0.1 login hi5 password {stack.key}\n")
    read = subprocess.run(
        [sys.executable, "-c", READ_BY_ADDRESS, address],
        # The cache is read once by a process.
        env={**os.environ, "CROISSANT_CACHE": str(tmp_path), "NETRC": str(netrc)},
        check=True,
        capture_output=True,
        text=True,
    )
    assert json.loads(read.stdout) == sorted(f"{index:09d}.jpg" for index in range(COUNT))


def test_a_download_and_an_export_hold_every_image(
    stack: Machine, dataset_id: str, tmp_path: Path
) -> None:
    done = stack.hi5("download", dataset_id, "--out", tmp_path, "--images", "--json").json()
    assert (done["shards"], done["images"]) == (3, COUNT)
    assert len(list((tmp_path / "images").glob("*.jpg"))) == COUNT
    stack.hi5("export", "coco", "--from", dataset_id, "--out", tmp_path / "a.json")
    hi5("export", "coco", "--from", tmp_path, "--out", tmp_path / "b.json")
    exports = {(tmp_path / name).read_bytes() for name in ("a.json", "b.json", "coco.json")}
    assert len(exports) == 1


def test_an_audit_finds_nothing_and_then_what_we_break(stack: Machine, dataset_id: str) -> None:
    sound = stack.audit(dataset_id)
    assert (sound["findings"], sound["unpublished"]) == ([], 0)
    (tar,) = (stack.data_dir / "store").glob(f"datasets/{dataset_id}/shards/000001/*/samples.tar")
    content = tar.read_bytes()
    tar.write_bytes(content[:-1] + b"x")
    for way in ("--direct", "--json"):
        directly = [f"--data-dir={stack.data_dir}"] if way == "--direct" else []
        report = stack.hi5("audit", dataset_id, "--json", way, *directly, check=False)
        assert report.code == 1
        assert report.json()["wrong_bytes"] == 1
    tar.write_bytes(content[:-1024])
    assert stack.audit(dataset_id)["wrong_bytes"] == 1
    tar.unlink()
    assert stack.audit(dataset_id)["missing"] == 1
    tar.write_bytes(content)
    assert "missing 0" in stack.hi5("audit", dataset_id).out


def test_a_dataset_is_cancelled_and_deleted(stack: Machine, tmp_path: Path) -> None:
    spec = write_spec(tmp_path / "s.yaml", count=3000, images_per_shard=50, name="many")
    doomed = str(stack.submit(spec))
    stack.hi5("cancel", doomed)
    watched = stack.hi5("watch", doomed, check=False)
    assert watched.code == 1
    assert "cancelled" in watched.err
    assert "status: cancelled" in stack.hi5("retry", doomed, check=False).err
    stack.hi5("delete", doomed, "--yes")
    gone = stack.hi5("manifest", doomed, check=False)
    assert gone.code == 2
    assert f"dataset_id: {doomed}" in gone.err


def test_a_wrong_spec_is_refused_before_it_is_sent(stack: Machine, tmp_path: Path) -> None:
    spec = write_spec(tmp_path / "s.yaml", count=0)
    refused = stack.hi5("submit", spec, check=False)
    assert refused.code == 2
    assert "count: 0" in refused.err


def test_the_doctor_finds_this_machine_well(stack: Machine) -> None:
    results = hi5("doctor", "--json", "--data-dir", stack.data_dir, check=False).json()
    assert [result["name"] for result in results if not result["ok"]] == []
