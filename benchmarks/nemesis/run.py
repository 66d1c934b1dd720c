"""A whole run: start everything, strike, let it come to rest, look."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from sqlalchemy import Select, func, select

from benchmarks.nemesis.checker import Verdict, check
from benchmarks.nemesis.faults import COMPONENT, Arena, Done, Ending, Missed
from benchmarks.nemesis.history import Entry, History
from benchmarks.nemesis.processes import Fleet
from benchmarks.nemesis.schedule import Strike, strikes
from benchmarks.nemesis.servers import Servers, Site, servers_running
from benchmarks.nemesis.users import Shape, Users
from benchmarks.nemesis.world import World, survey
from hi5_common.db import keys
from hi5_common.db.engine import Database, Session, open_database
from hi5_common.db.tables import DatasetRow, ShardRow
from hi5_common.domain.access import LOCAL_OWNER, Scope
from hi5_common.domain.errors import Hi5Error
from hi5_common.domain.records import ShardStatus
from hi5_common.queue.celery_doorbell import CeleryDoorbell
from hi5_common.storage.open import open_store
from hi5_common.storage.port import ObjectStore
from tests.support.servers import free_ports

LOOK_S = 0.05
CALM_S = 0.5
AIM_S = 5.0
"""How long to wait for something to hit; then the strike is missed."""
RETRY_S = 5.0
"""How often users look for shards that hi5 gave up."""
SMALL = Shape(shards=10, images_per_shard=4, image_s=0.25)
KEEPERS = 2
ANY_RATE = "1000000/second"
OBJECTS_OF_A_SHARD = 3
SETTLED = frozenset({ShardStatus.DONE, ShardStatus.CANCELLED})
PATIENCE_S = 180.0
"""A run that makes no progress for so long is over, finished or not."""


@dataclass(frozen=True)
class Options:
    """How much of what. shards: at least so many; more if faults take longer than they do."""

    seed: int
    faults: int
    shards: int
    workers: int = 3
    shape: Shape = SMALL


@dataclass(frozen=True)
class Outcome:
    """What a run leaves behind: what was done and seen, what is there, and what is wrong."""

    options: Options
    entries: list[Entry]
    world: World
    verdict: Verdict
    seconds: float
    quiet_seconds: float
    """Of `seconds`, those after the last fault."""


@dataclass
class Run:
    """A fleet under fire."""

    options: Options
    servers: Servers
    site: Site
    fleet: Fleet
    users: Users
    history: History
    database: Database
    store: ObjectStore
    say: Callable[[str], None]
    endings: dict[str, Ending] = field(default_factory=dict)
    numbers: dict[str, int] = field(default_factory=dict)
    """Of the strikes whose endings are to come, by target."""
    retry_s: float = 0.0
    """When users look for failed shards again, on the clock of time.monotonic()."""
    settled: int = 0
    """Published or cancelled shards when we last could look."""

    def strike_all(self) -> None:
        """Do every fault, and keep work coming as long as that takes."""
        arena = Arena(
            self.fleet,
            self.servers,
            self.site,
            self.users,
            self.database,
            CeleryDoorbell(self.site.ours),
            lambda target: target not in self.endings,
        )
        done = 0
        for strike in strikes(self.options.seed):
            if done == self.options.faults:
                break
            self._wait(strike.gap_s)
            self._keep_busy(done)
            component = COMPONENT.get(strike.kind)
            while component in self.endings:
                self._wait(LOOK_S)
            if not self._strike(arena, strike):
                continue
            done += 1
            if done % 100 == 0:
                self.say(f"{done} faults, {self._settled()} shards published or cancelled")
        while self.endings:
            self._wait(LOOK_S)
        arena.doorbell.close()

    def come_to_rest(self) -> None:
        """Wait until all is published and swept, or until nothing moves any more."""
        while self.users.kept * self.options.shape.shards < self.options.shards:
            self.users.want()
        self.users.hurry()
        self._wait_for(self.users.left)
        self._wait_for(self._unfinished)
        self._wait_for(self._orphans)
        self.users.stop()

    def _strike(self, arena: Arena, strike: Strike) -> bool:
        """Do a fault as soon as there is something to hit; return whether there was."""
        began = {"number": strike.number, "kind": strike.kind, "name": strike.kind.name}
        result = self._struck(arena, strike)
        if result is None:
            self.history.append("missed", **began)
            return False
        self.history.append("fault", target=result.target, **began)
        if result.ending is None:
            self.history.append("healed", number=strike.number)
        else:
            self.endings[result.target] = result.ending
            self.numbers[result.target] = strike.number
        return True

    def _struck(self, arena: Arena, strike: Strike) -> Done | None:
        give_up_s = time.monotonic() + AIM_S
        while True:
            try:
                return arena.strike(strike)
            except Missed:
                if time.monotonic() > give_up_s:
                    return None
                self._wait(LOOK_S)

    def _wait(self, seconds: float) -> None:
        """Let time go by; undo what is due, and start again what ended by itself."""
        until_s = time.monotonic() + seconds
        while True:
            for target, ending in list(self.endings.items()):
                if ending.due():
                    ending.undo()
                    del self.endings[target]
                    self.history.append("healed", number=self.numbers.pop(target))
            for process in self.fleet.died():
                self.history.append("died", target=process.name, exit_code=process.exit_code())
                process.start()
            if time.monotonic() >= until_s:
                return
            time.sleep(LOOK_S)

    def _keep_busy(self, faults_done: int) -> None:
        """Submit as the faults go on, and more if the fleet would run out of work."""
        options = self.options
        size = options.shape.shards
        share = (faults_done + 1) / options.faults
        while self.users.kept * size < min(options.shards, share * options.shards + size):
            self.users.want()
        self._retry_failed()
        if (self.users.asked - self.users.deleted) * size - self._settled() < size:
            self.users.want()

    def _settled(self) -> int:
        """Return how many shards are to be left alone, as far as we know."""
        with suppress(Hi5Error), self.database.snapshot() as session:  # it may be away
            self.settled = _count(session, *SETTLED)
        return self.settled

    def _wait_for(self, left: Callable[[], int]) -> None:
        """Wait until nothing is left, as long as it becomes less."""
        least, patient_until_s = left(), time.monotonic() + PATIENCE_S
        while least and time.monotonic() < patient_until_s:
            self._wait(CALM_S)
            now = left()
            if now < least:
                least, patient_until_s = now, time.monotonic() + PATIENCE_S

    def _unfinished(self) -> int:
        """Count shards to come."""
        self._retry_failed()
        with self.database.snapshot() as session:
            failed = len(session.scalars(_to_retry()).all())
            return failed + _count(session, ShardStatus.PENDING, ShardStatus.LEASED)

    def _retry_failed(self) -> None:
        """Have users ask again, now and then, for shards that hi5 gave up."""
        if time.monotonic() < self.retry_s:
            return
        self.retry_s = time.monotonic() + RETRY_S
        with suppress(Hi5Error), self.database.snapshot() as session:  # it may be away
            for dataset_id in session.scalars(_to_retry().distinct()).all():
                self.users.retry_soon(dataset_id)

    def _orphans(self) -> int:
        """Count objects that are more than three for every published shard."""
        with self.database.snapshot() as session:
            published = _count(session, ShardStatus.DONE)
        kept = sum(1 for _ in self.store.list("datasets"))
        return max(0, kept - OBJECTS_OF_A_SHARD * published)


def _to_retry() -> Select[UUID]:
    """Select the dataset of each shard that hi5 gave up and that is still wanted."""
    return (
        select(ShardRow.dataset_id)
        .join(DatasetRow, DatasetRow.id == ShardRow.dataset_id)
        .where(
            ShardRow.status == ShardStatus.FAILED.value, DatasetRow.cancel_requested_at.is_(None)
        )
    )


def _count(session: Session, *states: ShardStatus) -> int:
    names = [state.value for state in states]
    query = select(func.count()).where(ShardRow.status.in_(names))
    return int(session.scalar(query) or 0)


@contextmanager
def arena(options: Options, folder: Path, say: Callable[[str], None]) -> Iterator[Run]:
    """Start servers and fleet; end them at the end."""
    with servers_running(folder) as servers:
        site = servers.site(folder)
        fleet = Fleet(
            site.theirs,
            folder,
            free_ports(1)[0],
            options.workers,
            KEEPERS,
            variables={"HI5_API_RATE": ANY_RATE},
        )
        history = History(folder / "history.jsonl")
        database = open_database(site.ours.database_url)
        users = Users(fleet.url, _key(database), history, options.shape, options.seed)
        run = Run(
            options,
            servers,
            site,
            fleet,
            users,
            history,
            database,
            open_store(site.ours),
            say,
        )
        fleet.start()
        users.start()
        try:
            yield run
        finally:
            fleet.end()
            database.dispose()


def _key(database: Database) -> str:
    """Return a new key of the users'."""
    with database.transaction() as session:
        return keys.create(session, keys.Granted(LOCAL_OWNER, Scope.WRITE)).text


def carry_out(options: Options, folder: Path, say: Callable[[str], None]) -> Outcome:
    """Do a whole run; everything it writes goes to the folder."""
    with arena(options, folder, say) as run:
        began_s = time.monotonic()
        run.history.append("begin", seed=options.seed)
        run.strike_all()
        last_s = time.monotonic()
        say(f"{options.faults} faults are done; waiting for rest")
        run.come_to_rest()
        ended_s = time.monotonic()
        run.fleet.end()
        for process in run.fleet.workers:
            _take_log(run.history, process.log_path)
        world = survey(run.database, run.store)
        entries = run.history.entries()
        verdict = check(entries, world, run.site.template)
    return Outcome(options, entries, world, verdict, ended_s - began_s, ended_s - last_s)


def _take_log(history: History, path: Path) -> None:
    """Add to the history what a worker believes to have published."""
    for line in path.read_text("utf-8", "replace").splitlines():
        if '"action": "published"' in line:
            told = json.loads(line)
            history.append(
                "worker_published",
                dataset_id=told["dataset_id"],
                shard=told["shard"],
                attempt=told["attempt"],
            )
