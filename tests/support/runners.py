"""A worker's slot with everything around it in one process: for tests of single attempts."""

from pathlib import Path

from hi5_common.db.engine import Database
from hi5_common.settings import Settings
from hi5_common.storage.port import ObjectStore
from services.worker.fleet.shard_runner import ShardRunner


def settings(folder: Path, **changes: object) -> Settings:
    """Return settings with short times, so that tests need not wait."""
    quick = {
        "data_dir": folder,
        "cache_dir": folder / "cache",
        "scratch_dir": folder / "scratch",
        "lease_s": 4,
        "renew_s": 1,
        "reconcile_s": 1,
        "dispatch_s": 0.2,
        "ring_s": 2,
        "sweep_s": 1,
        "orphan_grace_s": 0,
        "render_threads": 1,
        "canary": False,  # children that draw nothing would never pass; test_canary.py has it on
    }
    return Settings.model_validate(quick | changes)


def runner(
    database: Database,
    store: ObjectStore,
    folder: Path,
    owner: str = "w",
    child: str = "tests.support.stand_in_child",
) -> ShardRunner:
    """Return a slot; the stand-in child's fault is the dataset's name."""
    return ShardRunner(
        database=database,
        store=store,
        settings=settings(folder, child_module=child, renderer="fake"),
        owner=owner,
        draining=lambda: False,
    )
