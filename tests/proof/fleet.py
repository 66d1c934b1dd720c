"""What a fleet of the state machine consists of, and how each of its acts is done and judged."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from hypothesis.stateful import RuleBasedStateMachine

from hi5_common.db import datasets, shards
from hi5_common.db.engine import Session
from hi5_common.db.errors import LeaseLost
from hi5_common.db.tables import Base
from hi5_common.domain import keys
from hi5_common.domain.errors import TransientError
from hi5_common.domain.records import Gap, Publication, Shard, ShardStatus, StoredObject, Tallies
from hi5_common.domain.sharding import ShardRange, shard_ranges
from hi5_common.domain.spec import DatasetSpec
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.publish import publish
from services.worker.keeper import Keeper
from tests.proof.ledger import Ledger
from tests.support import runners
from tests.support.faulty import (
    CommitFault,
    FaultyDatabase,
    FaultyDoorbell,
    FaultyStore,
    StoreFault,
)
from tests.support.virtual_time import VirtualTime

LEASE_S, MARGIN_S, GRACE_S = 60.0, 15.0, 120.0
REQUEST_S = 60.0
"""A request to the store that is older can no longer arrive: shorter than the keeper's grace."""
MOST_DATASETS = 3
COUNT_EVERY = 10
FILES = (keys.SAMPLES, keys.LABELS, keys.MEMBERS)


@dataclass(frozen=True)
class Cut:
    """A plan that only knows where shards begin and end."""

    spec: DatasetSpec

    def shards(self) -> tuple[ShardRange, ...]:
        return tuple(shard_ranges(self.spec))

    def tallies(self) -> Tallies:
        return Tallies({}, {})

    def tallies_of_first(self, count: int) -> Tallies:
        raise NotImplementedError(f"base and spec are balanced alike, so nobody asks: {count}")


@dataclass
class Worker:
    """An attempt as its worker sees it: it may have lost its lease long ago.

    renewed_s: when it last knew that it had the lease, on the machine's clock.
    """

    shard: Shard
    owner: str
    renewed_s: float
    stored: list[StoredObject] = field(default_factory=list)
    publication: Publication | None = None

    def proof(self) -> tuple[UUID, int, str]:
        return self.shard.id, self.shard.attempt, self.owner


@dataclass
class Seen:
    """How many steps were made, and how often what was met: a machine may not idle unnoticed."""

    steps: int = 0
    met: Counter[str] = field(default_factory=Counter)


class Fleet(RuleBasedStateMachine):
    """A database, a store, a broker, a keeper, workers, and what users were told."""

    def __init__(
        self, database: FaultyDatabase, time: VirtualTime, folder: Path, seen: Seen
    ) -> None:
        super().__init__()
        self.database, self.time, self.folder, self.seen = database, time, folder, seen
        time.begin_again()
        with database.transaction() as session:
            for table in reversed(Base.metadata.sorted_tables):
                session.execute(table.delete())
        self.store = FaultyStore(now_s=time.seconds)
        self.doorbell = FaultyDoorbell()
        settings = runners.settings(
            folder, lease_s=LEASE_S, renew_s=15, ring_s=30, orphan_grace_s=GRACE_S
        )
        self.keeper = Keeper(database, self.store, self.doorbell, settings)
        self.ledger = Ledger(database, self.store)
        self.workers: list[Worker] = []
        self.specs: dict[UUID, DatasetSpec] = {}
        self.cancelled: set[UUID] = set()
        self.names = 0

    def create(self, spec: DatasetSpec, fault: CommitFault) -> None:
        """Submit as a client does: with a key, and again until it is told how it went."""
        self.names += 1
        self.time.advance(0.001)  # ids tell the order of what is not submitted at the same moment
        key = f"submission-{self.names}"
        made = self.insist(
            lambda s: datasets.create(s, spec, Cut(spec), idempotency_key=key), fault
        )
        assert made.created == (fault is not CommitFault.UNKNOWN)
        self.specs[made.dataset.id] = spec
        self.ledger.datasets[made.dataset.id] = spec.count

    def insist[Answer](self, act: Callable[[Session], Answer], fault: CommitFault) -> Answer:
        self.met(f"commit_{fault.value}")
        self.database.faults[:] = [fault]
        for _ in range(2):
            try:
                with self.database.transaction() as session:
                    return act(session)
            except TransientError:
                continue
        raise AssertionError("only the first commit was to fail")

    def store_files(self, worker: Worker, files: int, faults: list[StoreFault]) -> None:
        if self.time.seconds() - worker.renewed_s > LEASE_S - MARGIN_S:
            self.workers.remove(worker)
            self.met("fenced_itself")
            return
        self.store.faults[:] = faults
        for _ in range(files):
            try:
                self.store_next(worker)
            except TransientError as error:
                self.met(type(error).__name__)
        self.store.faults.clear()

    def keep(self, duty: Callable[[], int], commits: list[CommitFault]) -> None:
        self.database.faults[:] = commits
        try:
            self.met(duty.__name__, duty())
        except TransientError:
            self.met(f"{duty.__name__}_failed")
        self.database.faults.clear()

    def take(self, hint: UUID | None, fault: CommitFault) -> None:
        """Claim; who does not hear the answer does not know, and the lease runs out."""
        owner = f"worker-{self.seen.steps}-{len(self.workers)}"
        sent_s = self.time.seconds()
        self.database.faults[:] = [fault]
        try:
            with self.database.transaction() as session:
                shard = shards.claim(session, hint, owner, LEASE_S)
        except TransientError:
            self.met("claim_unheard")
            return
        if shard is not None:
            self.met("claimed")
            self.workers.append(Worker(shard, owner, sent_s))

    def store_next(self, worker: Worker) -> None:
        shard = worker.shard
        prefix = keys.shard_prefix(shard.dataset_id, shard.number, shard.attempt)
        if worker.publication is None:
            path = self.folder / FILES[len(worker.stored)]
            path.write_bytes(f"{prefix}/{path.name} {worker.owner}".encode())
            sha256 = digest(path)
            worker.stored.append(publish(self.store, f"{prefix}/{path.name}", path, sha256))
        if len(worker.stored) == len(FILES) and worker.publication is None:
            worker.publication = made_of(shard, worker.stored, prefix)
            self.ledger.made[worker.publication.samples.key] = worker.publication

    def settle(
        self,
        worker: Worker,
        act: Callable[[Session, UUID, int, str], object],
        fault: CommitFault,
        *,
        known: bool = False,
    ) -> bool:
        """Send a transition; the database must take it from the holder of the lease alone.

        known: it has taken it already, and must say so again. Returns whether it said yes.
        """
        entitled = self.holds(worker) or known
        self.database.faults[:] = [fault]
        try:
            with self.database.transaction() as session:
                act(session, *worker.proof())
        except LeaseLost:
            assert not entitled, "the holder of a lease was refused"
            self.ledger.refused = True
            self.met("stale_write_refused")
            self.workers.remove(worker)
            return False
        except TransientError:
            self.met(f"settle_{fault.value}")
            return False  # the worker does not know, and will ask again
        assert entitled, "a zombie was believed"
        self.workers.remove(worker)
        return True

    def holds(self, worker: Worker) -> bool:
        row = self.ledger.shards.get(worker.shard.id)
        return (
            row is not None
            and row.dataset_id not in self.ledger.deleted
            and (row.status, row.lease_owner) == (ShardStatus.LEASED.value, worker.owner)
        )

    def pass_time(self, seconds: float) -> None:
        self.time.advance(seconds)
        self.store.forget(REQUEST_S)

    def complete(self) -> list[UUID]:
        """Return the datasets of which every image is published."""
        left = {
            row.dataset_id
            for row in self.ledger.shards.values()
            if row.status != ShardStatus.DONE.value or (row.publication or {}).get("gaps")
        }
        return [dataset_id for dataset_id in self.specs if dataset_id not in left]

    def failed(self) -> list[UUID]:
        """Return the datasets that have shards which a user may have tried again."""
        rows = self.ledger.shards.values()
        found = {row.dataset_id for row in rows if row.status == ShardStatus.FAILED.value}
        return [dataset_id for dataset_id in self.specs if dataset_id in found]

    def bases(self) -> list[DatasetSpec]:
        return [spec.extends for spec in self.specs.values() if spec.extends is not None]

    def finishing(self) -> list[Worker]:
        return [worker for worker in self.workers if worker.publication is not None]

    def unsettled(self) -> bool:
        open_states = {ShardStatus.PENDING.value, ShardStatus.LEASED.value}
        return any(row.status in open_states for row in self.ledger.shards.values())

    def met(self, what: str, times: int = 1) -> None:
        self.seen.met[what] += times


def chosen[Item](items: list[Item], which: int) -> Item:
    """Return one of some items, the same one for the same number."""
    return items[which % len(items)]


def made_of(shard: Shard, stored: list[StoredObject], prefix: str) -> Publication:
    """Return a publication whose counts are those of no other attempt; the second has a gap."""
    gaps = (Gap(shard.start, "failed 3 times"),) if shard.attempt == 2 else ()
    count = shard.stop - shard.start - len(gaps)
    tallies = Tallies({"all": count, f"attempt={shard.attempt}": count}, {prefix: 1})
    samples, labels, members = stored
    return Publication(samples, labels, members, count, tallies, gaps)
