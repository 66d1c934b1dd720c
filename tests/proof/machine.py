"""Any order of everything that fleets meet, over hi5's own database, store, keeper and doorbell."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from hi5_common.db import datasets, shards
from hi5_common.db.engine import Session
from hi5_common.db.errors import DatasetInUse, DatasetNotFound, LeaseLost
from hi5_common.db.shards import RenewAnswer
from hi5_common.db.tables import Base
from hi5_common.domain import keys
from hi5_common.domain.errors import TransientError
from hi5_common.domain.records import Gap, Publication, Shard, ShardStatus, StoredObject, Tallies
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.sharding import ShardRange, shard_ranges
from hi5_common.domain.spec import DatasetSpec
from hi5_common.queue.port import hinted_shard
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.publish import publish
from services.worker.keeper import Keeper
from tests.proof.ledger import Ledger
from tests.support import factories, runners
from tests.support.faulty import (
    BrokerFault,
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

WHICH = st.integers(0, 2**16)
COMMITS = st.sampled_from([CommitFault.NONE] * 8 + list(CommitFault)[1:])
STORES = st.sampled_from([StoreFault.NONE] * 6 + list(StoreFault)[1:])


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
    """Workers, users, a broker and a keeper that act and fail in any order."""

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

    def teardown(self) -> None:
        self.converge()

    # ------------------------------------------------------------------ users

    @initialize(shards_wanted=st.integers(1, 3))
    def begin(self, shards_wanted: int) -> None:
        self.submit(shards_wanted, CommitFault.NONE)

    @precondition(lambda self: len(self.specs) < MOST_DATASETS)
    @rule(shards_wanted=st.integers(1, 3), fault=COMMITS)
    def submit(self, shards_wanted: int, fault: CommitFault) -> None:
        self.create(factories.spec(2 * shards_wanted, 2, seed=self.names), fault)

    @precondition(lambda self: len(self.specs) < MOST_DATASETS and self.complete())
    @rule(which=WHICH, fault=COMMITS)
    def extend(self, which: int, fault: CommitFault) -> None:
        base = self.specs[chosen(self.complete(), which)]
        if base.extends is None:
            more = base.model_copy(update={"count": base.count + 3, "extends": base})
            self.create(more, fault)
            self.met("extend")

    @precondition(lambda self: self.specs)
    @rule(which=WHICH, fault=COMMITS, cancel=st.integers(0, 3))
    def cancel_or_retry(self, which: int, fault: CommitFault, cancel: int) -> None:
        dataset_id = chosen(self.failed() or list(self.specs), which)
        if cancel:
            revived = self.insist(lambda s: datasets.retry_failed(s, dataset_id), fault)
            self.met("revive", revived)
        else:
            self.insist(lambda s: datasets.request_cancel(s, dataset_id), fault)
            self.cancelled.add(dataset_id)

    @precondition(lambda self: len(self.specs) > 1)
    @rule(which=WHICH, fault=COMMITS)
    def delete(self, which: int, fault: CommitFault) -> None:
        extended = [d for d, spec in self.specs.items() if spec in self.bases()]
        dataset_id = chosen((extended if which % 2 else []) or list(self.specs), which)
        try:
            self.insist(lambda s: datasets.delete(s, dataset_id), fault)
        except DatasetInUse:
            self.met("in_use")
            return
        except DatasetNotFound:
            assert fault is CommitFault.UNKNOWN
        self.ledger.deleted.add(dataset_id)
        del self.specs[dataset_id]

    # ------------------------------------------------------------------ messages

    @rule(fault=st.sampled_from(BrokerFault), commit=COMMITS)
    def ring(self, fault: BrokerFault, commit: CommitFault) -> None:
        self.doorbell.fault = fault
        self.keep(self.keeper.dispatch, [commit])
        self.doorbell.fault = BrokerFault.NONE

    @precondition(lambda self: self.doorbell.messages)
    @rule(which=WHICH, fault=COMMITS)
    def deliver(self, which: int, fault: CommitFault) -> None:
        """Bring any message, the newest too: messages may overtake each other."""
        del_at = which % len(self.doorbell.messages)
        message = self.doorbell.messages[del_at]
        del self.doorbell.messages[del_at]
        self.take(hinted_shard(message), fault)

    @precondition(lambda self: self.doorbell.messages)
    @rule(which=WHICH, how=st.sampled_from(["drop", "double", "empty"]))
    def mistreat(self, which: int, how: str) -> None:
        messages = self.doorbell.messages
        if how == "double":
            messages.append(chosen(list(messages), which))
        elif how == "drop":
            del messages[which % len(messages)]
        else:
            messages.clear()
        self.met(how)

    # ------------------------------------------------------------------ workers

    @rule(fault=COMMITS)
    def claim(self, fault: CommitFault) -> None:
        self.take(None, fault)

    @rule(which=WHICH, stages=st.integers(1, 5))
    def work(self, which: int, stages: int) -> None:
        """Let a worker, a new one if there is none, do some of what comes next; nothing fails."""
        if not self.workers:
            self.take(None, CommitFault.NONE)
        elif chosen(self.workers, which).publication is not None:
            self.finish(self.finishing().index(chosen(self.workers, which)), CommitFault.NONE)
        if self.workers:
            self.store_files(chosen(self.workers, which), stages, [])

    @precondition(lambda self: self.workers)
    @rule(which=WHICH, files=st.integers(1, 3), faults=st.lists(STORES, max_size=6))
    def upload(self, which: int, files: int, faults: list[StoreFault]) -> None:
        """Store some of a shard's files, as long as the worker's own clock lets it."""
        self.store_files(chosen(self.workers, which), files, faults)

    @precondition(lambda self: self.finishing())
    @rule(which=WHICH, fault=COMMITS)
    def finish(self, which: int, fault: CommitFault) -> None:
        worker = chosen(self.finishing(), which)
        publication = worker.publication
        assert publication is not None
        earlier = self.ledger.published.get(worker.shard.id)
        mine = earlier is not None and earlier.samples == publication.samples
        told = self.settle(
            worker, lambda s, i, a, o: shards.finish(s, i, a, o, publication), fault, known=mine
        )
        if told:
            self.ledger.acknowledged[worker.shard.id] = publication
            self.met("published")

    @precondition(lambda self: self.workers)
    @rule(which=WHICH, kind=st.one_of(st.none(), st.sampled_from(FailureKind)), fault=COMMITS)
    def give_back(self, which: int, kind: FailureKind | None, fault: CommitFault) -> None:
        """Fail, or release if nothing failed."""
        worker = chosen(self.workers, which)
        if kind is None:
            self.settle(worker, shards.release, fault)
        else:
            self.settle(worker, lambda s, i, a, o: shards.fail(s, i, a, o, kind, ""), fault)

    @precondition(lambda self: self.workers)
    @rule(which=WHICH, fault=COMMITS, progress=st.integers(0, 2))
    def renew(self, which: int, fault: CommitFault, progress: int) -> None:
        worker, sent_s = chosen(self.workers, which), self.time.seconds()
        answers: list[RenewAnswer] = []

        def send(session: Session, shard_id: UUID, attempt: int, owner: str) -> None:
            answers.append(shards.renew(session, shard_id, attempt, owner, LEASE_S, progress))

        if not self.settle(worker, send, fault):
            return
        worker.renewed_s = sent_s
        if not answers[0].cancel_requested:
            self.workers.append(worker)
            return
        assert worker.shard.dataset_id in self.cancelled
        self.workers.append(worker)
        self.settle(worker, shards.cancel, CommitFault.NONE)

    @precondition(lambda self: self.workers)
    @rule(which=WHICH)
    def die(self, which: int) -> None:
        self.workers.remove(chosen(self.workers, which))

    @precondition(lambda self: self.workers)
    @rule(which=WHICH)
    def zombie(self, which: int) -> None:
        """Stop a worker for longer than its lease; another one takes the shard meanwhile."""
        stopped = chosen(self.workers, which)
        self.pass_time(LEASE_S + 1)
        self.keeper.sweep_leases()
        self.ledger.check()
        self.pass_time(300)
        self.take(stopped.shard.id, CommitFault.NONE)

    # ------------------------------------------------------------------ time and the keeper

    @rule(seconds=st.sampled_from([1.0, 8.0, 20.0, 61.0, 310.0]))
    def tick(self, seconds: float) -> None:
        self.pass_time(seconds)

    @rule()
    def land(self) -> None:
        """Let requests arrive that the store had given up."""
        self.met("landed_late", len(self.store.on_their_way))
        self.store.land()

    @rule(fault=COMMITS)
    def sweep(self, fault: CommitFault) -> None:
        self.keep(self.keeper.sweep_leases, [fault])

    @rule(stores=st.lists(STORES, max_size=2), commits=st.lists(COMMITS, max_size=1))
    def collect(self, stores: list[StoreFault], commits: list[CommitFault]) -> None:
        self.store.faults[:] = stores
        self.keep(self.keeper.sweep_objects, commits)
        self.store.faults.clear()

    # ------------------------------------------------------------------ what must hold

    @invariant()
    def nothing_is_lost_doubled_or_wrong(self) -> None:
        self.seen.steps += 1
        self.ledger.check()
        if self.seen.steps % COUNT_EVERY == 0:
            self.ledger.check_counts()

    def converge(self) -> None:
        """Let healthy workers and a healthy keeper do what is left; check that all ends well."""
        self.workers.clear()
        self.pass_time(REQUEST_S + 1)
        for _ in range(20):
            self.pass_time(310)
            self.keeper.sweep_leases()
            self.ledger.check()
            self.keeper.dispatch()
            while self.doorbell.messages:
                self.take(hinted_shard(self.doorbell.messages.popleft()), CommitFault.NONE)
            for worker in tuple(self.workers):
                self.ledger.check()
                while worker.publication is None:
                    self.store_next(worker)
                self.finish(self.finishing().index(worker), CommitFault.NONE)
            self.ledger.check()
            if not self.unsettled():
                break
        assert not self.unsettled(), "shards were never settled"
        self.pass_time(GRACE_S + 2 * LEASE_S + 1)
        self.met("collected", self.keeper.sweep_objects())
        self.ledger.check()
        self.ledger.check_counts()
        self.check_ends()

    def check_ends(self) -> None:
        for row in self.ledger.shards.values():
            cancelled = row.dataset_id in self.cancelled
            assert row.status != ShardStatus.CANCELLED.value or cancelled, "cancelled unasked"
        kept = {stored.key for stored in self.ledger.referenced()}
        assert {entry.key for entry in self.store.list("datasets")} == kept, "orphans were left"

    # ------------------------------------------------------------------ how it is done

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
