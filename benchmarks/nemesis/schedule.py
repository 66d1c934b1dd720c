"""Which fault comes when: a pure function of the seed. What it hits depends on the moment."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from hi5_common.domain.seeding import factor_rng


class FaultKind(StrEnum):
    """What the nemesis can do."""

    CHILD_KILL = "render child: SIGKILL"
    CHILD_SEGV = "render child: SIGSEGV"
    CHILD_STOP = "render child: SIGSTOP until the worker kills it"
    POOL_KILL = "pool process: SIGKILL"
    ZOMBIE = "pool process: SIGSTOP for longer than its lease"
    WORKER_KILL = "worker, all its processes: SIGKILL, started again"
    MAIN_KILL = "worker, main process only: SIGKILL, started again"
    WORKER_DRAIN = "worker: SIGTERM, started again"
    KEEPER_KILL = "keeper: SIGKILL, started again"
    KEEPER_STOP = "keeper: SIGSTOP for a while"
    API_KILL = "API while a dataset is submitted: SIGKILL, started again"
    BROKER_KILL = "Valkey: SIGKILL, started again empty"
    BROKER_FLUSH = "Valkey: FLUSHALL"
    BROKER_DOUBLED = "every doorbell message ten times"
    BROKER_RESET = "connections to Valkey: reset"
    BROKER_FROZEN = "connections to Valkey: frozen, then reset"
    BROKER_SLOW = "connections to Valkey: slow"
    DATABASE_KILL = "Postgres: immediate stop, started again"
    DATABASE_RESET = "connections to Postgres: reset"
    DATABASE_FROZEN = "connections to Postgres: frozen, then reset"
    DATABASE_DEAF = "answers of Postgres: lost, then connections reset"
    DATABASE_SLOW = "connections to Postgres: slow"
    STORE_KILL = "S3 store: SIGKILL, started again"
    STORE_RESET = "connections to the S3 store: reset"
    STORE_FROZEN = "connections to the S3 store: frozen, then reset"
    STORE_DEAF = "answers of the S3 store: lost, then connections reset"
    STORE_SLOW = "connections to the S3 store: slow"
    STORE_LIES = "S3 store keeps wrong bytes and answers 200"
    STORE_LATE = "S3 store does as asked and answers 500"


@dataclass(frozen=True)
class _Habit:
    """How often a fault comes, relative to the others, and how long it lasts, in seconds."""

    weight: float
    shortest_s: float = 0.0
    longest_s: float = 0.0


_HABITS = {
    FaultKind.CHILD_KILL: _Habit(10),
    FaultKind.CHILD_SEGV: _Habit(8),
    FaultKind.CHILD_STOP: _Habit(2),
    FaultKind.POOL_KILL: _Habit(6),
    FaultKind.ZOMBIE: _Habit(4, 1.0, 3.0),  # beyond the lease
    FaultKind.WORKER_KILL: _Habit(5, 0.1, 1.0),
    FaultKind.MAIN_KILL: _Habit(3, 0.1, 1.0),
    FaultKind.WORKER_DRAIN: _Habit(4),
    FaultKind.KEEPER_KILL: _Habit(4, 0.1, 1.0),
    FaultKind.KEEPER_STOP: _Habit(2, 1.0, 4.0),
    FaultKind.API_KILL: _Habit(4, 0.1, 1.0),
    FaultKind.BROKER_KILL: _Habit(4, 0.2, 2.0),
    FaultKind.BROKER_FLUSH: _Habit(6),
    FaultKind.BROKER_DOUBLED: _Habit(4),
    FaultKind.BROKER_RESET: _Habit(3),
    FaultKind.BROKER_FROZEN: _Habit(3, 1.0, 3.0),
    FaultKind.BROKER_SLOW: _Habit(2, 1.0, 3.0),
    FaultKind.DATABASE_KILL: _Habit(4, 0.2, 2.0),
    FaultKind.DATABASE_RESET: _Habit(4),
    FaultKind.DATABASE_FROZEN: _Habit(3, 1.0, 3.0),
    FaultKind.DATABASE_DEAF: _Habit(4, 0.5, 2.0),
    FaultKind.DATABASE_SLOW: _Habit(2, 1.0, 3.0),
    FaultKind.STORE_KILL: _Habit(3, 0.2, 2.0),
    FaultKind.STORE_RESET: _Habit(3),
    FaultKind.STORE_FROZEN: _Habit(3, 1.0, 3.0),
    FaultKind.STORE_DEAF: _Habit(3, 0.5, 2.0),
    FaultKind.STORE_SLOW: _Habit(2, 1.0, 3.0),
    FaultKind.STORE_LIES: _Habit(3),
    FaultKind.STORE_LATE: _Habit(3),
}
_KINDS = tuple(_HABITS)
_WEIGHTS = [_HABITS[kind].weight for kind in _KINDS]
SHORTEST_GAP_S, LONGEST_GAP_S = 0.1, 0.8


@dataclass(frozen=True)
class Strike:
    """One fault to come, `gap_s` after the one before, for `lasts_s`.

    chances: numbers of [0, 1) for whatever the fault has to choose.
    """

    number: int
    kind: FaultKind
    gap_s: float
    lasts_s: float
    chances: tuple[float, float]


def strikes(seed: int) -> Iterator[Strike]:
    """Yield faults without end."""
    total = sum(_WEIGHTS)
    number = 0
    while True:
        rng = factor_rng(seed, number, "nemesis")
        kind = _KINDS[int(rng.choice(len(_KINDS), p=[each / total for each in _WEIGHTS]))]
        habit = _HABITS[kind]
        gap_s, lasts_s = (
            rng.uniform(SHORTEST_GAP_S, LONGEST_GAP_S),
            rng.uniform(habit.shortest_s, habit.longest_s),
        )
        yield Strike(number, kind, gap_s, lasts_s, (rng.random(), rng.random()))
        number += 1
