"""A worker's slot, opened from the settings. Not for the worker's main process: it has threads."""

from collections.abc import Callable

from hi5_common.db.engine import open_database
from hi5_common.domain.workers import new_owner
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from services.worker.fleet.shard_runner import ShardRunner


def open_runner(settings: Settings, draining: Callable[[], bool]) -> ShardRunner:
    """Return a slot over the database and the store that the settings name."""
    return ShardRunner(
        database=open_database(settings.resolved_database_url),
        store=open_store(settings),
        settings=settings,
        owner=new_owner(settings.worker_name),
        draining=draining,
    )
