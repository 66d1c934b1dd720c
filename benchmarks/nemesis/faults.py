"""How each fault is done, and undone."""

import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import redis

from benchmarks.nemesis.processes import Fleet, Process, exists
from benchmarks.nemesis.schedule import FaultKind, Strike
from benchmarks.nemesis.servers import Servers, Site
from benchmarks.nemesis.users import Users
from hi5_common.db import shards
from hi5_common.db.engine import Database
from hi5_common.domain.errors import Hi5Error
from hi5_common.queue.celery_doorbell import CeleryDoorbell
from tests.support.fleet import descendants, kill
from tests.support.proxy import TcpProxy
from tests.support.servers import wait_for_bucket

TOLD_S = 5.0
"""A store that is told to lie and not asked for so long is no more told to."""
DRAIN_S = 120.0
MOST_DOUBLED = 10
COPIES = 10
LIES = 3
_SLOW_S = 0.2


class Missed(Exception):
    """There is nothing to hit just now."""


@dataclass(frozen=True)
class Ending:
    """What undoes a fault: at a time of time.monotonic(), or earlier once `ready` says so."""

    at_s: float
    undo: Callable[[], None]
    ready: Callable[[], bool] = lambda: False

    def due(self) -> bool:
        """Return whether to undo it now."""
        return time.monotonic() >= self.at_s or self.ready()


@dataclass(frozen=True)
class Done:
    """A fault that happened: to what, and how it ends (None: it is over already)."""

    target: str
    ending: Ending | None = None


@dataclass
class Arena:
    """Everything that can be hit."""

    fleet: Fleet
    servers: Servers
    site: Site
    users: Users
    database: Database
    doorbell: CeleryDoorbell
    is_free: Callable[[str], bool]
    """Whether no fault is going on at a target."""

    def strike(self, strike: Strike) -> Done:
        """Do it. Raises Missed."""
        return _ACTS[strike.kind](self, strike)

    def worker(self, strike: Strike, condition: Callable[[Process], bool]) -> Process:
        """Return a worker without a fault for which the condition holds. Raises Missed."""
        return self._one_of(self.fleet.workers, strike, condition)

    def keeper(self, strike: Strike) -> Process:
        """Return a keeper without a fault. Raises Missed."""
        return self._one_of(self.fleet.keepers, strike, lambda _: True)

    def _one_of(
        self, those: Sequence[Process], strike: Strike, condition: Callable[[Process], bool]
    ) -> Process:
        found = [
            each
            for each in those
            if self.is_free(each.name) and each.exit_code() is None and condition(each)
        ]
        if not found:
            raise Missed
        return found[int(strike.chances[0] * len(found))]


def _later(strike: Strike, undo: Callable[[], None]) -> Ending:
    return Ending(time.monotonic() + strike.lasts_s, undo)


def _child(arena: Arena, strike: Strike, number: signal.Signals) -> Done:
    worker = arena.worker(strike, lambda each: bool(arena.fleet.render_children(each)))
    for pid in _still(arena.fleet.render_children(worker)):
        kill(pid, number)
    return Done(worker.name)


def _child_kill(arena: Arena, strike: Strike) -> Done:
    return _child(arena, strike, signal.SIGKILL)


def _child_segv(arena: Arena, strike: Strike) -> Done:
    return _child(arena, strike, signal.SIGSEGV)


def _child_stop(arena: Arena, strike: Strike) -> Done:
    return _child(arena, strike, signal.SIGSTOP)


def _pool_kill(arena: Arena, strike: Strike) -> Done:
    worker = arena.worker(strike, lambda each: bool(arena.fleet.busy_pool(each)))
    for pid in _still(arena.fleet.busy_pool(worker)):
        kill(pid)
    return Done(worker.name)


def _zombie(arena: Arena, strike: Strike) -> Done:
    worker = arena.worker(strike, lambda each: bool(arena.fleet.busy_pool(each)))
    pids = _still(arena.fleet.busy_pool(worker))
    for pid in pids:
        kill(pid, signal.SIGSTOP)

    def wake() -> None:
        for pid in pids:
            kill(pid, signal.SIGCONT)

    settings = arena.fleet.settings
    asleep_s = settings.lease_s + settings.reconcile_s + strike.lasts_s
    gone = Ending(time.monotonic() + asleep_s, wake, lambda: not any(exists(pid) for pid in pids))
    return Done(worker.name, gone)


def _worker_kill(arena: Arena, strike: Strike) -> Done:
    worker = arena.worker(strike, lambda each: bool(descendants(each.pid)))
    worker.end()
    return Done(worker.name, _later(strike, worker.start))


def _main_kill(arena: Arena, strike: Strike) -> Done:
    worker = arena.worker(strike, lambda each: bool(descendants(each.pid)))
    worker.signal(signal.SIGKILL)
    return Done(worker.name, _later(strike, worker.start))


def _worker_drain(arena: Arena, strike: Strike) -> Done:
    worker = arena.worker(strike, lambda each: bool(arena.fleet.busy_pool(each)))
    worker.signal(signal.SIGTERM)

    def restart() -> None:
        drained = worker.exit_code()
        worker.end()
        if drained != 0:
            arena.users.history.append("drain_failed", target=worker.name, exit_code=drained)
        worker.start()

    ending = Ending(time.monotonic() + DRAIN_S, restart, lambda: worker.exit_code() is not None)
    return Done(worker.name, ending)


def _killed(process: Process, strike: Strike) -> Done:
    process.end()
    return Done(process.name, _later(strike, process.start))


def _keeper_kill(arena: Arena, strike: Strike) -> Done:
    return _killed(arena.keeper(strike), strike)


def _keeper_stop(arena: Arena, strike: Strike) -> Done:
    keeper = arena.keeper(strike)
    keeper.signal(signal.SIGSTOP)
    return Done(keeper.name, _later(strike, lambda: keeper.signal(signal.SIGCONT)))


def _api_kill(arena: Arena, strike: Strike) -> Done:
    arena.users.want()
    time.sleep(0.1 * strike.chances[0])
    return _killed(arena.fleet.api, strike)


def _broker_kill(arena: Arena, strike: Strike) -> Done:
    arena.servers.valkey.crash()
    return Done("broker", _later(strike, arena.servers.valkey.start))


def _broker_flush(arena: Arena, _strike: Strike) -> Done:
    try:
        with redis.Redis.from_url(arena.site.ours.broker_url) as client:
            client.flushall()
    except redis.RedisError as error:
        raise Missed from error
    return Done("broker")


def _broker_doubled(arena: Arena, _strike: Strike) -> Done:
    try:
        with arena.database.transaction() as session:
            due = shards.pending_to_ring(session, MOST_DOUBLED, 0)
        arena.doorbell.ring(due * COPIES)
    except Hi5Error as error:
        raise Missed from error
    if not due:
        raise Missed
    return Done("broker")


def _reset(name: str, proxy: TcpProxy) -> Done:
    if not proxy.reset():
        raise Missed
    return Done(name)


def _frozen(name: str, proxy: TcpProxy, strike: Strike) -> Done:
    proxy.frozen = True
    return Done(name, _later(strike, lambda: _thaw(proxy)))


def _deaf(name: str, proxy: TcpProxy, strike: Strike) -> Done:
    proxy.answers_frozen = True
    return Done(name, _later(strike, lambda: _thaw(proxy)))


def _thaw(proxy: TcpProxy) -> None:
    proxy.reset()
    proxy.heal()


def _slow(name: str, proxy: TcpProxy, strike: Strike) -> Done:
    proxy.delay_s = _SLOW_S * (0.2 + strike.chances[0])
    return Done(name, _later(strike, proxy.heal))


def _database_kill(arena: Arena, strike: Strike) -> Done:
    arena.servers.postgres.crash()
    return Done("database", _later(strike, arena.servers.postgres.start))


def _store_kill(arena: Arena, strike: Strike) -> Done:
    arena.servers.s3.weed.crash()

    def start() -> None:
        arena.servers.s3.weed.start()
        wait_for_bucket(arena.servers.s3)

    return Done("store", _later(strike, start))


def _tell(arena: Arena, change: Callable[[int], None]) -> Done:
    """Have the store misbehave LIES times; that is over once it did."""
    store = arena.servers.lying_store
    told = store.told
    change(LIES)

    def stop() -> None:
        store.lies = store.late_errors = 0

    ending = Ending(time.monotonic() + TOLD_S, stop, lambda: store.told >= told + LIES)
    return Done("store", ending)


def _store_lies(arena: Arena, _strike: Strike) -> Done:
    return _tell(arena, lambda count: setattr(arena.servers.lying_store, "lies", count))


def _store_late(arena: Arena, _strike: Strike) -> Done:
    return _tell(arena, lambda count: setattr(arena.servers.lying_store, "late_errors", count))


def _still(pids: Sequence[int]) -> Sequence[int]:
    """Return the processes. Raises Missed if they ended meanwhile."""
    if not pids:
        raise Missed
    return pids


_ACTS: dict[FaultKind, Callable[[Arena, Strike], Done]] = {
    FaultKind.CHILD_KILL: _child_kill,
    FaultKind.CHILD_SEGV: _child_segv,
    FaultKind.CHILD_STOP: _child_stop,
    FaultKind.POOL_KILL: _pool_kill,
    FaultKind.ZOMBIE: _zombie,
    FaultKind.WORKER_KILL: _worker_kill,
    FaultKind.MAIN_KILL: _main_kill,
    FaultKind.WORKER_DRAIN: _worker_drain,
    FaultKind.KEEPER_KILL: _keeper_kill,
    FaultKind.KEEPER_STOP: _keeper_stop,
    FaultKind.API_KILL: _api_kill,
    FaultKind.BROKER_KILL: _broker_kill,
    FaultKind.BROKER_FLUSH: _broker_flush,
    FaultKind.BROKER_DOUBLED: _broker_doubled,
    FaultKind.BROKER_RESET: lambda arena, _: _reset("broker", arena.servers.broker),
    FaultKind.BROKER_FROZEN: lambda arena, it: _frozen("broker", arena.servers.broker, it),
    FaultKind.BROKER_SLOW: lambda arena, it: _slow("broker", arena.servers.broker, it),
    FaultKind.DATABASE_KILL: _database_kill,
    FaultKind.DATABASE_RESET: lambda arena, _: _reset("database", arena.servers.database),
    FaultKind.DATABASE_FROZEN: lambda arena, it: _frozen("database", arena.servers.database, it),
    FaultKind.DATABASE_DEAF: lambda arena, it: _deaf("database", arena.servers.database, it),
    FaultKind.DATABASE_SLOW: lambda arena, it: _slow("database", arena.servers.database, it),
    FaultKind.STORE_KILL: _store_kill,
    FaultKind.STORE_RESET: lambda arena, _: _reset("store", arena.servers.store),
    FaultKind.STORE_FROZEN: lambda arena, it: _frozen("store", arena.servers.store, it),
    FaultKind.STORE_DEAF: lambda arena, it: _deaf("store", arena.servers.store, it),
    FaultKind.STORE_SLOW: lambda arena, it: _slow("store", arena.servers.store, it),
    FaultKind.STORE_LIES: _store_lies,
    FaultKind.STORE_LATE: _store_late,
}

COMPONENT = {
    kind: kind.name.partition("_")[0].lower()
    for kind in FaultKind
    if kind.name.startswith(("BROKER", "DATABASE", "STORE", "API"))
}
"""The target of the faults that have only one. A fault waits until none goes on at its target."""
