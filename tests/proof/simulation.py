"""One run: users, workers and keepers on hi5's own code, everything else and time simulated."""

import argparse
import json
import logging
import random
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from unittest.mock import patch
from uuid import UUID

from hi5_common.db import datasets, deliveries, events, shards
from hi5_common.db.engine import Database, Session
from hi5_common.db.tables import Base
from hi5_common.domain.errors import TransientError
from hi5_common.domain.records import Publication, Shard, ShardStatus
from hi5_common.domain.spec import DatasetSpec
from hi5_common.queue.port import hinted_shard
from hi5_common.settings import Settings
from hi5_common.storage import publish
from hi5_common.storage.obstore_store import digest
from services.worker import keeper as keeping
from services.worker.fleet import lease, shard_runner
from services.worker.fleet.heartbeat import Heartbeat
from services.worker.fleet.lease import Lease
from services.worker.fleet.shard_render import ShardRender
from services.worker.fleet.shard_runner import ShardRunner
from services.worker.keeper import Keeper
from tests.proof.faultpoints import KEEPER, Fault, Points
from tests.proof.scheduler import Event, Process, Scheduler, Threading, Time
from tests.proof.world import (
    LATE_S,
    SimulatedDatabase,
    SimulatedDoorbell,
    SimulatedRender,
    SimulatedStore,
    cheap_pack,
    memory_database,
    virtual_moment,
)
from tests.support import factories, runners

GRACE_S = 120.0
CALM_S = 150.0
"""From here on nothing fails."""
END_S = 3000.0
"""By then everything is settled, or it never is."""
CHANCE = 0.08
SETTINGS = {
    "lease_s": 60,
    "renew_s": 15,
    "reconcile_s": 40,
    "dispatch_s": 40,
    "ring_s": 30,
    "sweep_s": 60,
    "orphan_grace_s": GRACE_S,
    "block_s": 30,
}


@dataclass
class Verdict:
    """What a checker found after a run; every list is to be empty."""

    attempted: int = 0
    acknowledged: int = 0
    lost: list[str] = field(default_factory=list)
    duplicated: list[str] = field(default_factory=list)
    unexpected: list[str] = field(default_factory=list)
    unfinished: list[str] = field(default_factory=list)
    orphans: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)

    def violations(self) -> dict[str, list[str]]:
        """Return what is wrong, by its kind."""
        kinds = ("lost", "duplicated", "unexpected", "unfinished", "orphans", "errors")
        return {kind: getattr(self, kind) for kind in kinds if getattr(self, kind)}


@dataclass(frozen=True, kw_only=True)
class SimulatedRunner(ShardRunner):
    """hi5's own slot, with a render child that is simulated."""

    points: Points

    def _render(self, shard: Shard, spec: DatasetSpec, lease: Lease, folder: Path) -> ShardRender:
        return SimulatedRender(  # type: ignore[return-value]  # the part that is used
            self.points,
            self.points.rng,
            range(shard.start, shard.stop),
            lease.check,
            self.draining,
        )


@dataclass(frozen=True)
class Silent(Heartbeat):
    """A sign of life that nobody looks at."""

    def beat(self, problem: str | None = None) -> None:
        """Leave no file behind."""

    def end(self) -> None:
        """Leave no file behind."""


class Simulation:
    """A run of one seed. `tables` is a database in memory whose tables exist."""

    def __init__(self, seed: int, tables: Database, folder: Path) -> None:
        self.rng = random.Random(seed)
        self.scheduler = Scheduler(self.rng)
        self.points = Points(self.scheduler, self.rng, CHANCE, CALM_S)
        self.database = SimulatedDatabase(tables.engine, self.points)
        self.store = SimulatedStore(self.points, lambda key: key in self.published)
        self.doorbell = SimulatedDoorbell(self.points)
        self.folder = folder
        self.time = Time(self.scheduler)
        self.published: set[str] = set()
        self.history: defaultdict[UUID, set[str]] = defaultdict(set)
        self.specs: dict[UUID, DatasetSpec] = {}
        self.cancelled: set[UUID] = set()
        self.deleted: set[UUID] = set()
        self.draining: set[str] = set()
        self.started = self.busy = 0
        self.closing = False
        with tables.engine.connect() as connection:
            raw = connection.connection.driver_connection
            virtual_moment(lambda: self.scheduler.now_s)(raw)
            for table in reversed(Base.metadata.sorted_tables):
                connection.execute(table.delete())
            connection.commit()

    def run(self) -> Verdict:
        """Let everything happen; return what the checker found."""
        with self._simulated():
            for number in range(self.rng.choice([2, 2, 3])):
                self._start(f"worker{number}", self._work)
            for number in range(self.rng.choice([1, 1, 2])):
                self._start(f"{KEEPER}{number}", self._keep)
            self._use()
            while self.scheduler.now_s < END_S and self._unsettled():
                self._try_failed_again()
                self.scheduler.sleep(80.0)
            self.closing = True
            while self.scheduler.now_s < END_S and (self._rubbish() or self.busy):
                self.scheduler.sleep(40.0)
            self.scheduler.end()
            return self._verdict()

    @contextmanager
    def _simulated(self) -> Iterator[None]:
        with ExitStack() as stack:
            for module in (shard_runner, lease, publish, keeping):
                stack.enter_context(patch.object(module, "time", self.time))
            stack.enter_context(patch.object(lease, "threading", Threading(self.scheduler)))
            stack.enter_context(patch.object(shard_runner, "pack", cheap_pack))
            stack.enter_context(self.database.noting())
            stack.enter_context(patch.object(shards, "finish", self._recorded(shards.finish)))
            yield

    def _recorded(self, finish: Callable[..., None]) -> Callable[..., None]:
        """Keep a history of what the database took as published, apart from its rows."""

        def recorded(
            session: Session, shard_id: UUID, attempt: int, owner: str, made: Publication
        ) -> None:
            finish(session, shard_id, attempt, owner, made)
            self.database.then.append(lambda: self._published(shard_id, made))

        return recorded

    def _published(self, shard_id: UUID, made: Publication) -> None:
        self.points.say(f"published {made.samples.key[-40:]}")
        self.history[shard_id].add(made.samples.key)
        self.published |= {made.samples.key, made.labels.key, made.members.key}

    # ------------------------------------------------------------------ processes

    def _start(self, name: str, act: Callable[[str], None]) -> None:
        """Start a process, and another one of its name whenever it has died."""

        def watch() -> None:
            while not (self.closing and act == self._work):
                process = Process(name)
                task = self.scheduler.start(process, lambda: act(name))
                while not task.done:
                    self.scheduler.sleep(20.0)
                self.scheduler.sleep(self.rng.uniform(0.0, 40.0))

        self.scheduler.start(Process(f"init-{name}"), watch)

    def _work(self, name: str) -> None:
        """Do what Celery's pool process and the poller do."""
        self.started += 1
        settings = settings_of(self.folder, name)
        runner = SimulatedRunner(
            database=self.database,
            store=self.store,
            settings=settings,
            owner=f"{name}-{self.started}",
            draining=lambda: self._drains(name),
            points=self.points,
        )
        while not self.closing and not self._drains(name):
            message = self.doorbell.take()
            self.busy += 1
            try:
                runner.run_while_due(hinted_shard(message), 100)
            except TransientError:
                self.points.say("no work taken")
            finally:
                self.busy -= 1
            self.scheduler.sleep(self.rng.uniform(10.0, 40.0))
        self.draining.discard(name)

    def _drains(self, name: str) -> bool:
        if self.points.draw("drain", Fault.FAIL) and self.rng.random() < 0.5:
            self.draining.add(name)
        return name in self.draining

    def _keep(self, name: str) -> None:
        keeper = Keeper(self.database, self.store, self.doorbell, settings_of(self.folder, name))
        keeping.run(keeper, Event(self.scheduler), Silent(self.folder, name))  # type: ignore[arg-type]

    # ------------------------------------------------------------------ users

    def _use(self) -> None:
        """Submit, and perhaps cancel, try again or delete, while everything goes wrong."""
        for _ in range(self.rng.choice([1, 2])):
            count, size = self.rng.choice([(2, 2), (4, 2), (3, 3)])
            spec = factories.spec(count, size, seed=len(self.specs))
            with self.database.transaction() as session:
                made = datasets.create(session, spec, factories.Cut(count, size)).dataset
            self.specs[made.id] = spec
            self.scheduler.sleep(self.rng.uniform(1.0, 60.0))
        dataset_id = self.rng.choice(list(self.specs))
        act = self.rng.choice([None, None, None, self._cancel, self._delete])
        if act is not None:
            act(dataset_id)
        self.scheduler.sleep(max(0.0, CALM_S + LATE_S + 10.0 - self.scheduler.now_s))

    def _left(self) -> list[UUID]:
        return [dataset_id for dataset_id in self.specs if dataset_id not in self.deleted]

    def _try_failed_again(self) -> None:
        for each in self._left():
            with self.database.transaction() as session:
                datasets.retry_failed(session, each)

    def _cancel(self, dataset_id: UUID) -> None:
        with self.database.transaction() as session:
            datasets.request_cancel(session, dataset_id)
        self.cancelled.add(dataset_id)

    def _delete(self, dataset_id: UUID) -> None:
        with self.database.transaction() as session:
            datasets.delete(session, dataset_id)
        self.deleted.add(dataset_id)
        self.published = {k for k in self.published if str(dataset_id) not in k}

    # ------------------------------------------------------------------ the checker

    def _rows(self) -> list[Shard]:
        with self.database.snapshot() as session:
            return [
                shard
                for dataset_id in self._left()
                for shard in shards.of_dataset(session, dataset_id, 100)
            ]

    def _unsettled(self) -> list[Shard]:
        settled = {ShardStatus.DONE, ShardStatus.CANCELLED}
        return [shard for shard in self._rows() if shard.status not in settled]

    def _rubbish(self) -> set[str]:
        return self.store.objects.keys() - self.published

    def _verdict(self) -> Verdict:
        verdict = Verdict()
        verdict.errors = [repr(error) for error in self.scheduler.failures] + self.store.violations
        rows = self._rows()
        verdict.attempted = sum(shard.attempt for shard in rows)
        verdict.acknowledged = len(self.history)
        verdict.unfinished = [str(shard.id) for shard in self._unsettled()]
        verdict.orphans = sorted(self._rubbish())
        for shard in rows:
            self._judge(shard, verdict)
        with self.database.snapshot() as session:
            for dataset_id in self._left():
                self._judge_sums(session, dataset_id, rows, verdict)
        return verdict

    def _judge(self, shard: Shard, verdict: Verdict) -> None:
        """Compare a row with the history and with the objects that it points to."""
        known = self.history[shard.id]
        if len(known) > 1:
            verdict.duplicated.append(f"{shard.id}: {sorted(known)}")
        if shard.publication is None:
            verdict.lost += [f"{key}: no row has it" for key in known]
            if shard.status is ShardStatus.CANCELLED and shard.dataset_id not in self.cancelled:
                verdict.unexpected.append(f"{shard.id} was cancelled unasked")
            return
        if known != {shard.publication.samples.key}:
            verdict.unexpected.append(f"{shard.publication.samples.key}: nobody published it")
        for stored in (
            shard.publication.samples,
            shard.publication.labels,
            shard.publication.members,
        ):
            data = self.store.objects.get(stored.key)
            if data is None or digest(data) != stored.sha256:
                verdict.lost.append(f"{stored.key}: gone or not what was published")
            elif json.loads(data) != shard.images():
                verdict.unexpected.append(f"{stored.key}: other images than its row")

    def _judge_sums(
        self, session: Session, dataset_id: UUID, rows: list[Shard], verdict: Verdict
    ) -> None:
        mine = [shard for shard in rows if shard.dataset_id == dataset_id]
        images = Counter(index for shard in mine for index in shard.images())
        counted = deliveries.tallies(session, dataset_id).values
        if counted != {f"image={index}": times for index, times in images.items()}:
            verdict.unexpected.append(f"{dataset_id}: the running sums say {counted}")
        verdict.duplicated += [f"{dataset_id}/{i}" for i, times in images.items() if times > 1]
        covered = [index for shard in mine for index in range(shard.start, shard.stop)]
        if covered != list(range(self.specs[dataset_id].count)):
            verdict.lost.append(f"{dataset_id}: its shards cover {covered}")
        ends = [e for e in events.of_dataset(session, dataset_id, 10_000) if e.kind == "finish"]
        if len(ends) != sum(shard.status is ShardStatus.DONE for shard in mine):
            verdict.duplicated.append(f"{dataset_id}: {len(ends)} shards were finished")


@cache
def settings_of(folder: Path, name: str) -> Settings:
    """Return the settings of a machine of the simulation."""
    return runners.settings(folder, worker_name=name, **SETTINGS)


@contextmanager
def tables_in_memory() -> Iterator[Database]:
    """Yield a database in memory with hi5's tables."""
    made = memory_database()
    Base.metadata.create_all(made.engine)
    level = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield made
    finally:
        logging.disable(level)
        made.dispose()


def main(arguments: list[str]) -> int:
    """Run many seeds, or one with its trace; 1 if any found a violation."""
    parser = argparse.ArgumentParser(prog="tests.proof.simulation", description=__doc__)
    parser.add_argument("--seeds", type=int, default=2000, help="how many seeds to run")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--seed", type=int, help="run this one seed and print its trace")
    asked = parser.parse_args(arguments)
    first, count = (asked.first, asked.seeds) if asked.seed is None else (asked.seed, 1)
    found = 0
    struck: Counter[str] = Counter()
    with tables_in_memory() as tables, tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            simulation = Simulation(seed, tables, Path(folder))
            violations = simulation.run().violations()
            struck += simulation.points.struck
            if asked.seed is not None:
                sys.stdout.write("\n".join(simulation.points.trace) + "\n")
            if violations:
                found += 1
                sys.stdout.write(f"seed {seed}: {violations}\n")
                sys.stdout.flush()
    sys.stdout.write(f"{count} seeds, {struck.total()} faults at {len(struck)} points, ")
    sys.stdout.write(f"{found} seeds with violations\n")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
