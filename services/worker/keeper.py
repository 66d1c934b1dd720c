"""The keeper: `python -m services.worker.keeper` rings for pending shards and cleans up.

A loop of its own and no task of the queue: a rescuer must not need rescuing. Several at once do no
harm: every statement is guarded.
"""

import logging
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from uuid import UUID

from hi5_common.db import shards, upkeep, workers
from hi5_common.db.engine import Database, open_database
from hi5_common.domain import keys
from hi5_common.domain.errors import Hi5Error
from hi5_common.logs import configure_logging
from hi5_common.queue.celery_doorbell import CeleryDoorbell
from hi5_common.queue.port import Doorbell
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.removal import Removal, Sweep, remove_listed
from services.worker.fleet.heartbeat import Heartbeat

log = logging.getLogger(__name__)

STORE_PATIENCE_S = 5.0
"""The keeper only lists and deletes, and has other duties than to wait for a store."""


@dataclass(frozen=True)
class Keeper:
    """The keeper's duties, each one safe to do at any time, any number of times."""

    database: Database
    store: ObjectStore
    doorbell: Doorbell
    settings: Settings

    def dispatch(self) -> int:
        """Ring for due shards that nobody was told about lately; return how many.

        Never more than `max_rings` messages wait in the broker.
        """
        room = self.settings.max_rings - self.doorbell.waiting()
        if room <= 0:
            return 0
        with self.database.transaction() as session:
            shard_ids = shards.pending_to_ring(session, room, self.settings.ring_s)
        if shard_ids:
            self.doorbell.ring(shard_ids)
        return len(shard_ids)

    def sweep_leases(self) -> int:
        """Take back shards from silent workers and settle cancelled ones; return how many.

        Machines that were not seen for a week are forgotten.
        """
        with self.database.transaction() as session:
            expired = upkeep.sweep_expired(session)
            settled = upkeep.settle_cancelled(session)
            workers.forget_the_gone(session)
        for lease in expired:
            log.warning(
                "lease ran out",
                extra={"action": "expire", "shard_id": str(lease.shard_id), "owner": lease.owner},
            )
        return len(expired) + settled

    def sweep_objects(self) -> int:
        """Remove objects that no row can ever point to again; return how many.

        Objects of datasets this database knows nothing of are left alone.
        """
        # Longer than any lease, so that no worker can still be writing.
        late_s = self.settings.orphan_grace_s + 2 * self.settings.lease_s
        return (
            self._sweep_attempts()
            + self._sweep_deleted(late_s)
            + self.store.remove_unfinished(late_s)
        )

    def _sweep_attempts(self) -> int:
        with self.database.snapshot() as session:
            found = upkeep.attempts_to_sweep(session, self.settings.orphan_grace_s)
        sweep = Sweep[upkeep.AttemptsToSweep]()
        sweep.over(found, self._remove_attempts)
        if sweep.clean:
            with self.database.transaction() as session:
                upkeep.mark_swept(session, sweep.clean)
        return sweep.finish()

    def _remove_attempts(self, item: upkeep.AttemptsToSweep) -> Removal:
        folder = keys.shard_folder(item.dataset_id, item.number)
        return remove_listed(self.store, folder, lambda key: _attempt_of(key) < item.first_kept)

    def _sweep_deleted(self, late_s: float) -> int:
        with self.database.snapshot() as session:
            dataset_ids = upkeep.deleted_datasets(session)
        sweep = Sweep[UUID]()
        sweep.over(dataset_ids, self._remove_dataset)
        for dataset_id in sweep.clean:
            with self.database.transaction() as session:
                upkeep.forget_deleted(session, dataset_id, late_s)
        return sweep.finish()

    def _remove_dataset(self, dataset_id: UUID) -> Removal:
        return remove_listed(self.store, keys.dataset_prefix(dataset_id), lambda _key: True)


@dataclass
class Duty:
    """Something to do every `every_s` seconds. due_s is on the clock of time.monotonic()."""

    name: str
    every_s: float
    act: Callable[[], int]
    due_s: float = 0.0
    healthy: bool = True

    def run(self) -> None:
        """Do it and note whether it went well; what fails is tried again at the next turn."""
        self.due_s = time.monotonic() + self.every_s
        try:
            count = self.act()
        except Hi5Error as error:
            self.healthy = False
            log.warning("%s failed: %s", self.name, error, extra={"action": self.name})
        else:
            self.healthy = True
            if count:
                log.info("%s: %d", self.name, count, extra={"action": self.name})


def duties(keeper: Keeper) -> list[Duty]:
    """Return what a keeper does, and how often."""
    settings = keeper.settings
    return [
        Duty("dispatch", settings.dispatch_s, keeper.dispatch),
        Duty("sweep_leases", settings.reconcile_s, keeper.sweep_leases),
        Duty("sweep_objects", settings.sweep_s, keeper.sweep_objects),
    ]


def run(keeper: Keeper, stop: threading.Event, heartbeat: Heartbeat) -> None:
    """Do every duty in its time until told to stop."""
    todo = duties(keeper)
    while not stop.is_set():
        for duty in todo:
            if duty.due_s <= time.monotonic():
                duty.run()
        if all(duty.healthy for duty in todo):
            heartbeat.beat()
        stop.wait(max(0.0, min(duty.due_s for duty in todo) - time.monotonic()))
    heartbeat.end()


def main(arguments: list[str]) -> int:
    """Keep house until SIGTERM or SIGINT; with --check, say whether a keeper does so here."""
    settings = Settings()
    heartbeat = Heartbeat(settings.health_dir, "keeper")
    if "--check" in arguments:
        problem = heartbeat.problem()
        if problem:
            sys.stderr.write(f"{problem}\n")
        return 1 if problem else 0
    configure_logging(settings.log_format)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    database = open_database(settings.resolved_database_url)
    store = open_store(settings, STORE_PATIENCE_S)
    keeper = Keeper(database, store, CeleryDoorbell(settings), settings)
    run(keeper, stop, heartbeat)
    database.dispose()
    return 0


def _attempt_of(key: str) -> int:
    """Return the attempt that wrote an object; a key of another shape counts as never-ending."""
    parsed = keys.parse_attempt(key)
    return parsed.attempt if parsed else sys.maxsize


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
