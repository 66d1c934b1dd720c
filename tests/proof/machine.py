"""Any order of everything that fleets meet, over hi5's own database, store, keeper and doorbell."""

from uuid import UUID

from hypothesis import strategies as st
from hypothesis.stateful import initialize, invariant, precondition, rule

from hi5_common.db import datasets, shards
from hi5_common.db.engine import Session
from hi5_common.db.errors import DatasetInUse, DatasetNotFound
from hi5_common.db.shards import RenewAnswer
from hi5_common.domain.records import ShardStatus
from hi5_common.domain.retry import FailureKind
from hi5_common.queue.port import hinted_shard
from tests.proof.fleet import COUNT_EVERY, GRACE_S, LEASE_S, MOST_DATASETS, REQUEST_S, Fleet, chosen
from tests.support import factories
from tests.support.faulty import (
    BrokerFault,
    CommitFault,
    StoreFault,
)

WHICH = st.integers(0, 2**16)
COMMITS = st.sampled_from([CommitFault.NONE] * 8 + list(CommitFault)[1:])
STORES = st.sampled_from([StoreFault.NONE] * 6 + list(StoreFault)[1:])


class AnyOrder(Fleet):
    """Workers, users, a broker and a keeper that act and fail in any order."""

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
    @rule(which=WHICH, files=st.integers(1, 3), faults=st.lists(STORES, max_size=9))
    def upload(self, which: int, files: int, faults: list[StoreFault]) -> None:
        """Store some of a shard's files, as long as the worker's own clock lets it."""
        self.store_files(chosen(self.workers, which), files, faults)

    @precondition(lambda self: self.finishing())
    @rule(which=WHICH, fault=st.sampled_from(CommitFault))  # `work` finishes without
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
        elif worker in self.workers:  # it heard nothing, and asks again as ShardRunner does
            self.ledger.check()
            self.finish(self.finishing().index(worker), CommitFault.NONE)

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
