"""A worker's slot, opened from the settings. Not for the worker's main process: it has threads."""

from collections.abc import Callable
from functools import partial

from hi5_common.db.engine import open_database
from hi5_common.domain.workers import new_owner
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from hi5_common.storage.probe import probe_settings
from services.worker.fleet import drain
from services.worker.fleet.admission import Admission
from services.worker.fleet.canary import fly
from services.worker.fleet.shard_runner import ShardRunner


def open_runner(settings: Settings, draining: Callable[[], bool]) -> ShardRunner:
    """Return a slot over the database and the store that the settings name.

    It claims nothing before the store and the canary of its worker have passed. A process that
    belongs to no worker, and so has nobody to share the answer with, takes it as given.
    """
    return ShardRunner(
        database=open_database(settings.resolved_database_url),
        store=open_store(settings),
        settings=settings,
        owner=new_owner(settings.worker_name),
        draining=draining,
        admitted=_admission(settings, draining),
    )


def _admission(settings: Settings, draining: Callable[[], bool]) -> Callable[[], bool]:
    folder = drain.folder_of_this_process()
    if folder is None or not settings.canary:
        return lambda: True
    return Admission(folder, partial(_trial, settings, draining))


def _trial(settings: Settings, draining: Callable[[], bool]) -> None:
    """Try the store, then render: a picture that cannot be stored is no use. Raises as both do."""
    probe_settings(settings)
    fly(settings, draining)
