"""Real Cycles on two workers while a worker, a render child, Postgres and the S3 store die.

What comes out is, byte for byte, what one undisturbed process makes.
"""

import io
import subprocess
import sys
import tarfile
from pathlib import Path
from uuid import UUID

import pytest

from hi5_common.export.label_table import read_label_table
from hi5_common.settings import Settings
from tests.support import factories
from tests.support.fleet import (
    Fleet,
    environment,
    kill,
    pool_processes,
    render_children,
    wait_until,
)
from tests.support.servers import Postgres, S3Server, wait_for_bucket

pytestmark = [pytest.mark.integration, pytest.mark.render, pytest.mark.slow]

COUNT, SHARD = 40, 20


@pytest.fixture
def cycles_fleet(fleet: Fleet) -> Fleet:
    changes = {
        "child_module": "services.worker.render_child",
        "renderer": "cycles",
        "cache_dir": Settings().cache_dir,
    }
    fleet.settings = Settings.model_validate(fleet.settings.model_dump() | changes)
    return fleet


def test_whatever_dies_the_bytes_are_those_of_an_undisturbed_run(
    cycles_fleet: Fleet, postgres: Postgres, s3_server: S3Server, tmp_path: Path
) -> None:
    fleet = cycles_fleet
    made = factories.dataset(fleet.database, COUNT, SHARD, render={"quality": "draft"})
    fleet.start_keeper()
    doomed, survivor = fleet.start_worker(), fleet.start_worker()
    children: list[list[int]] = []

    def both_render() -> bool:
        children[:] = [render_children(each.pid, fleet.settings) for each in (doomed, survivor)]
        return all(children)

    wait_until(both_render, fleet.log)
    fleet.wait_for_progress(made.id, images=2)
    wait_until(both_render, fleet.log)

    s3_server.weed.crash()
    for pid in (doomed.pid, *pool_processes(doomed.pid, fleet.settings), *children[1]):
        kill(pid)
    postgres.crash()
    wait_until(lambda: "action=renew_failed" in fleet.log(), fleet.log)
    postgres.start()
    s3_server.weed.start()
    wait_for_bucket(s3_server)
    fleet.start_worker()

    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert "expire" in fleet.kinds(made.id)
    assert delivered(fleet, made.id) == undisturbed(fleet, made.spec.canonical_json(), tmp_path)


def delivered(fleet: Fleet, dataset_id: UUID) -> dict[str, bytes]:
    """Return every image and label of the published tars by name."""
    found: dict[str, bytes] = {}
    for shard in fleet.shards(dataset_id):
        assert shard.publication is not None
        content = fleet.store.get(shard.publication.samples.key)
        with tarfile.open(fileobj=io.BytesIO(content)) as tar:
            for item in tar:
                file = tar.extractfile(item)
                assert file is not None
                assert item.name not in found
                found[item.name] = file.read()
    return found


def undisturbed(fleet: Fleet, spec: str, folder: Path) -> dict[str, bytes]:
    """Return the same, rendered by one process without any service."""
    out = folder / "alone"
    (folder / "spec.json").write_text(spec, "utf-8")
    command = ("services.worker.local_render", str(folder / "spec.json"), "--out", str(out))
    subprocess.run(
        [sys.executable, "-m", *command],
        env=environment(fleet.settings),
        capture_output=True,
        check=True,
    )
    images = {path.name: path.read_bytes() for path in (out / "images").iterdir()}
    labels = read_label_table(out / "labels.parquet")
    return images | {f"{each.index:09d}.json": each.model_dump_json().encode() for each in labels}
