"""One slot of a worker on SQLite and a folder as store, with real render children."""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from uuid import UUID

from hi5_common.db import datasets, migrate, shards
from hi5_common.db.engine import open_database
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from hi5_common.storage.publish import verify
from services.worker.fleet.shard_runner import ShardRunner

UNFINISHED = frozenset({DatasetStatus.PENDING, DatasetStatus.RUNNING})


@dataclass(frozen=True)
class Slot:
    """A slot and the dataset it is to make."""

    runner: ShardRunner
    dataset_id: UUID

    def step(self) -> bool:
        """Make one attempt, or wait a moment if none is due; return False once all is done.

        Raises SystemExit if the dataset ends in any other way than complete.
        """
        with self.runner.database.snapshot() as session:
            status = datasets.get(session, self.dataset_id).status
        if status in UNFINISHED:
            if self.runner.run_next(None) is None:
                time.sleep(0.1)
            return True
        if status is not DatasetStatus.COMPLETE:
            raise SystemExit(f"the dataset is {status}")
        return False

    def published(self) -> dict[int, tuple[str, ...]]:
        """Return the SHA-256 of each shard's objects, each read back; fail on a redraw or gap."""
        found = {}
        with self.runner.database.snapshot() as session:
            rows = shards.of_dataset(session, self.dataset_id, 10_000)
        for row in rows:
            made = row.publication
            if made is None or made.gaps or made.redraws:
                raise SystemExit(f"shard {row.number} is not whole: {row}")
            objects = (made.samples, made.labels, made.members)
            for stored in objects:
                verify(self.runner.store, stored)
            found[row.number] = tuple(stored.sha256 for stored in objects)
        return found


@contextmanager
def open_slot(spec: DatasetSpec, settings: Settings) -> Iterator[Slot]:
    """Yield a slot with a new database and store in the settings' data folder."""
    url = settings.resolved_database_url
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    migrate.upgrade(url)
    database = open_database(url)
    try:
        with database.transaction() as session:
            made = datasets.create(session, spec, Plan.of(spec)).dataset
        runner = ShardRunner(database, open_store(settings), settings, "bench", lambda: False)
        yield Slot(runner, made.id)
    finally:
        database.dispose()


def small_frames(count: int, per_shard: int) -> DatasetSpec:
    """Return a dataset of 64 × 64 pixels in places that come with bpy, so that none is baked."""
    return parse_spec(
        {
            "name": "small frames",
            "count": count,
            "seed": 6,
            "images_per_shard": per_shard,
            "image": {"width": 64, "height": 64},
            "render": {"quality": "draft"},
            "attributes": {"environment": ["city", "courtyard"]},
        }
    )


def children_of_this_process(module: str) -> list[int]:
    """Return the children of this process that run a module."""
    found = []
    for path in Path("/proc/self/task").glob("*/children"):
        for pid in path.read_text("ascii").split():
            with suppress(OSError):
                if module.encode() in Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.append(int(pid))
    return found
