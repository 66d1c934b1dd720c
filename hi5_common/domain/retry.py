"""Whether a shard that failed is tried again, and when: a pure function of how it failed."""

from dataclasses import dataclass
from enum import StrEnum

MAX_FAILURES = 5
MAX_STORE_FAILURES = 50
"""A store that is away is no fault of the shard's: some four hours may pass until it is back."""
FIRST_DELAY_S = 5.0
LONGEST_DELAY_S = 300.0


class FailureKind(StrEnum):
    """Why an attempt ended without a publication."""

    LEASE_EXPIRED = "lease_expired"
    CHILD_START = "child_start"
    WORKER = "worker"
    IMAGE = "image"
    STORE = "store"
    WRONG_BYTES = "wrong_bytes"
    DISK_FULL = "disk_full"
    INTERNAL = "internal"


PERMANENT = frozenset({FailureKind.IMAGE})
"""An image is a pure function of its index: what failed three times, where others succeeded, fails
for ever. Where nothing succeeds the machine is to blame (WORKER), and another one may try."""


@dataclass(frozen=True)
class RetryLater:
    """Try again no sooner than `delay_s` seconds from now."""

    delay_s: float


@dataclass(frozen=True)
class GiveUp:
    """Do not try again unless a user asks for it."""


def decide(kind: FailureKind, failures: int) -> RetryLater | GiveUp:
    """Decide after the `failures`-th failure (1 is the first) of a shard.

    A first lost lease is retried at once: most often a machine went away, not the work.
    """
    most = MAX_STORE_FAILURES if kind is FailureKind.STORE else MAX_FAILURES
    if kind in PERMANENT or failures >= most:
        return GiveUp()
    if kind is FailureKind.LEASE_EXPIRED and failures == 1:
        return RetryLater(0.0)
    return RetryLater(min(FIRST_DELAY_S * 2.0 ** (failures - 1), LONGEST_DELAY_S))
