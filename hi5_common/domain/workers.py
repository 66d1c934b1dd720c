"""The machines that render: what they are called, and when one is no longer trusted with work."""

import uuid
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from hi5_common.domain.retry import FailureKind
from hi5_common.domain.strict import StrictModel

BAD_SHARDS = 3
"""So many different shards that failed on a machine, none published between, and it is blocked."""
LONGEST_BLOCK_S = 4 * 3600.0
NOT_THE_WORKERS = frozenset(
    {FailureKind.LEASE_EXPIRED, FailureKind.IMAGE, FailureKind.STORE},
)
"""Failures that say nothing about the machine: a database that was away lets every lease run out,
a store that is away fails everybody, and an image fails wherever it is rendered."""
_RANDOM_DIGITS = 12


@dataclass(frozen=True)
class BusySlot:
    """A shard that a machine holds, and how many of its images are rendered."""

    dataset_id: UUID
    shard_number: int
    progress: int
    size: int


@dataclass(frozen=True)
class Worker:
    """A machine: when it last asked for work, what it does, and whether it may claim.

    alive: it asked within the last minute and a half. blocked_until is None if it may claim.
    failed_shards: different ones that failed there since it last published one.
    """

    name: str
    seen_at: datetime
    alive: bool
    slots: int
    busy: tuple[BusySlot, ...]
    failed_shards: int
    blocked_until: datetime | None
    blocked_reason: str | None


class WorkerList(StrictModel):
    """Every machine, by its name."""

    items: list[Worker]


def new_owner(worker: str) -> str:
    """Return a name that no slot ever had before: the machine's, and something random."""
    return f"{worker}-{uuid.uuid4().hex[:_RANDOM_DIGITS]}"


def worker_of(owner: str) -> str:
    """Return the machine of a slot that `new_owner` named."""
    return owner[: -_RANDOM_DIGITS - 1]


def blames_the_worker(kind: FailureKind) -> bool:
    """Return whether a failure may be the machine's fault."""
    return kind not in NOT_THE_WORKERS


def block_s(first_s: float, blocks: int) -> float:
    """Return how long the `blocks`-th block in a row lasts (1 is the first): it doubles."""
    return float(min(first_s * 2.0 ** min(blocks - 1, 30), max(first_s, LONGEST_BLOCK_S)))
