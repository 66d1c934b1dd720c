"""Any order of claims, deaths, zombies, cancels and sweeps: what is published stays, once."""

import hashlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from uuid import UUID

from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    Bundle,
    MultipleResults,
    RuleBasedStateMachine,
    consumes,
    initialize,
    invariant,
    multiple,
    rule,
    run_state_machine_as_test,
)

from hi5_common.db import datasets, deliveries, events, shards
from hi5_common.db.engine import Database, Session
from hi5_common.db.errors import LeaseLost
from hi5_common.db.shards import RenewAnswer
from hi5_common.db.tables import Base, ShardRow
from hi5_common.domain import keys
from hi5_common.domain import tallies as counting
from hi5_common.domain.records import Publication, Shard, ShardStatus, StoredObject, Tallies
from hi5_common.domain.retry import FailureKind
from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.storage.open import memory_store
from services.worker.keeper import Keeper
from tests.support import factories, runners

EXAMPLES = 25


@dataclass
class Worker:
    """An attempt as its worker sees it: it may have lost its lease long ago."""

    shard: Shard
    owner: str
    publication: Publication
    acknowledged: bool = False
    fenced: bool = False


class Fleet(RuleBasedStateMachine):
    """Workers, users and a keeper that act in any order."""

    submitted = Bundle("submitted")
    workers = Bundle("workers")

    def __init__(self, database: Database, folder: Path) -> None:
        super().__init__()
        self.database = database
        with database.transaction() as session:
            for table in reversed(Base.metadata.sorted_tables):
                session.execute(table.delete())
        self.store = memory_store()
        self.keeper = Keeper(database, self.store, MemoryDoorbell(), runners.settings(folder))
        self.published: dict[UUID, Publication] = {}
        self.attempts: dict[UUID, int] = {}
        self.deleted: set[UUID] = set()
        self.everybody: list[Worker] = []

    def teardown(self) -> None:
        self.converge()

    @initialize(target=submitted)
    def begin(self) -> UUID:
        return factories.dataset(self.database, count=4, size=2).id

    @rule(target=submitted, shards_wanted=st.integers(1, 3))
    def submit(self, shards_wanted: int) -> UUID:
        return factories.dataset(self.database, count=2 * shards_wanted, size=2).id

    @rule(target=workers, hint=st.one_of(st.none(), st.just(UUID(int=5))))
    def claim(self, hint: UUID | None) -> MultipleResults[Worker]:
        owner = f"worker-{len(self.everybody)}"
        with self.database.transaction() as session:
            shard = shards.claim(session, hint, owner, 60)
        if shard is None:
            return multiple()
        assert shard.attempt > self.attempts.get(shard.id, 0), "a fencing token was used twice"
        self.attempts[shard.id] = shard.attempt
        worker = Worker(shard, owner, self.uploaded(shard))
        self.everybody.append(worker)
        return multiple(worker)

    @rule(target=workers)
    def take_over(self) -> MultipleResults[Worker]:
        """Let every worker fall silent and another one come."""
        self.every_worker_falls_silent()
        self.time_passes()
        return self.claim(None)

    @rule(worker=workers)
    def upload_late(self, worker: Worker) -> None:
        if not worker.fenced:
            self.uploaded(worker.shard)

    @rule(worker=workers, answer_lost=st.booleans())
    def finish(self, worker: Worker, answer_lost: bool) -> None:
        entitled = self.holds(worker) or worker.acknowledged
        for _ in range(1 + answer_lost):
            try:
                self.send_finish(worker)
            except LeaseLost:
                assert not entitled or worker.shard.dataset_id in self.deleted
                return
            assert entitled, "a zombie published"
            worker.acknowledged = True
            earlier = self.published.setdefault(worker.shard.id, worker.publication)
            assert earlier == worker.publication, "two publications of one shard"

    @rule(worker=workers, kind=st.sampled_from(FailureKind))
    def fail(self, worker: Worker, kind: FailureKind) -> None:
        self.try_to(lambda s, i, a, o: shards.fail(s, i, a, o, kind, ""), worker)

    @rule(worker=workers)
    def release(self, worker: Worker) -> None:
        self.try_to(shards.release, worker)

    @rule(worker=workers)
    def renew(self, worker: Worker) -> None:
        answers: list[RenewAnswer] = []
        self.try_to(lambda s, i, a, o: answers.append(shards.renew(s, i, a, o, 60, 1)), worker)
        if answers and answers[0].cancel_requested:
            self.try_to(shards.cancel, worker)

    @rule()
    def every_worker_falls_silent(self) -> None:
        with self.database.transaction() as session:
            for row in session.query(ShardRow).where(ShardRow.lease_until.is_not(None)):
                row.lease_until = row.changed_at - timedelta(seconds=1)
        self.keeper.sweep_leases()

    @rule()
    def time_passes(self) -> None:
        with self.database.transaction() as session:
            for row in session.query(ShardRow):
                row.not_before = row.changed_at - timedelta(seconds=1)

    @rule()
    def sweep(self) -> None:
        """Sweep, long after a zombie's own clock has stopped it from uploading."""
        for worker in self.everybody:
            worker.fenced = worker.fenced or not self.holds(worker)
        self.keeper.sweep_leases()
        self.keeper.sweep_objects()

    @rule(dataset_id=submitted)
    def cancel(self, dataset_id: UUID) -> None:
        if dataset_id not in self.deleted:
            with self.database.transaction() as session:
                datasets.request_cancel(session, dataset_id)

    @rule(dataset_id=submitted)
    def retry(self, dataset_id: UUID) -> None:
        if dataset_id not in self.deleted:
            with self.database.transaction() as session:
                datasets.retry_failed(session, dataset_id)

    @rule(dataset_id=consumes(submitted))
    def delete(self, dataset_id: UUID) -> None:
        with self.database.transaction() as session:
            datasets.delete(session, dataset_id)
        self.deleted.add(dataset_id)
        self.published = {
            shard_id: publication
            for shard_id, publication in self.published.items()
            if str(dataset_id) not in publication.samples.key
        }

    @invariant()
    def what_is_published_is_there(self) -> None:
        with self.database.snapshot() as session:
            rows = {row.id: row for row in session.query(ShardRow)}
        done = {shard_id for shard_id, row in rows.items() if row.status == ShardStatus.DONE.value}
        assert done == set(self.published)
        for publication in self.published.values():
            for stored in (publication.samples, publication.labels, publication.members):
                assert self.store.head(stored.key).size_bytes == stored.size_bytes

    @invariant()
    def the_running_sums_are_what_a_recount_gives(self) -> None:
        with self.database.snapshot() as session:
            found = datasets.page(session, 1000)
            assert [deliveries.tallies(session, each.id) for each in found] == [
                self.recounted(each.id) for each in found
            ]
            for each in found:
                rows = session.query(ShardRow).where(ShardRow.dataset_id == each.id).all()
                states = Counter(ShardStatus(row.status) for row in rows)
                by_status = [(row.status, row.stop - row.start, row.progress) for row in rows]
                assert each.shards_by_status == states
                assert each.images_done == sum(n for s, n, _ in by_status if s == "done")
                assert each.images_in_progress == sum(p for s, _, p in by_status if s == "leased")

    def recounted(self, dataset_id: UUID) -> Tallies:
        """Add up what every acknowledged publication of a dataset holds."""
        mine = [
            publication.tallies
            for publication in self.published.values()
            if str(dataset_id) in publication.samples.key
        ]
        return counting.add(*mine)

    def converge(self) -> None:
        """Let healthy workers do what is left; check that everything ends and nothing is left."""
        for worker in self.everybody:
            worker.fenced = True
        more = True
        while more:
            self.every_worker_falls_silent()
            self.time_passes()
            with self.database.transaction() as session:
                shard = shards.claim(session, None, "healthy", 60)
                more = shard is not None
            if shard is not None:
                healthy = Worker(shard, "healthy", self.uploaded(shard))
                self.finish(healthy, answer_lost=True)
        self.keeper.sweep_objects()
        self.what_is_published_is_there()
        kept = {e.key for e in self.store.list("datasets")}
        assert kept == {
            stored.key
            for publication in self.published.values()
            for stored in (publication.samples, publication.labels, publication.members)
        }
        with self.database.snapshot() as session:
            for row in session.query(ShardRow):
                assert ShardStatus(row.status) not in {ShardStatus.PENDING, ShardStatus.LEASED}
                history = events.of_dataset(session, row.dataset_id, 10_000)
                ends = [e for e in history if e.shard_number == row.number and e.kind == "finish"]
                assert len(ends) == (row.status == ShardStatus.DONE.value)

    def uploaded(self, shard: Shard) -> Publication:
        prefix = keys.shard_prefix(shard.dataset_id, shard.number, shard.attempt)
        digest = hashlib.sha256(prefix.encode()).hexdigest()
        made = [
            StoredObject(f"{prefix}/{name}", len(prefix), digest)
            for name in (keys.SAMPLES, keys.LABELS, keys.MEMBERS)
        ]
        for stored in made:
            self.store.put(stored.key, prefix.encode(), digest)
        samples, labels, members = made
        count = shard.stop - shard.start
        # Other counts in each attempt, so that adding up the wrong one shows.
        tallies = Tallies({"all": count, f"attempt={shard.attempt}": count}, {prefix: 1})
        return Publication(samples, labels, members, count, tallies)

    def send_finish(self, worker: Worker) -> None:
        with self.database.transaction() as session:
            shards.finish(session, *self.proof(worker), worker.publication)

    def holds(self, worker: Worker) -> bool:
        with self.database.snapshot() as session:
            row = session.get(ShardRow, worker.shard.id)
        return row is not None and row.lease_owner == worker.owner

    def try_to(self, act: Callable[[Session, UUID, int, str], object], worker: Worker) -> None:
        """Send a transition; the database must take it from the holder of the lease alone."""
        held = self.holds(worker)
        try:
            with self.database.transaction() as session:
                act(session, *self.proof(worker))
        except LeaseLost:
            assert not held
        else:
            assert held, "a zombie was believed"

    def proof(self, worker: Worker) -> tuple[UUID, int, str]:
        return worker.shard.id, worker.shard.attempt, worker.owner


def test_exactly_once(database: Database, tmp_path: Path) -> None:
    class FleetOnIt(Fleet):
        def __init__(self) -> None:
            super().__init__(database, tmp_path)

    run_state_machine_as_test(
        FleetOnIt, settings=hypothesis_settings(max_examples=EXAMPLES, stateful_step_count=40)
    )
