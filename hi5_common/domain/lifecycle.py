"""The life of a shard as a table, and the state of a dataset as a function of its shards."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType

from hi5_common.domain.records import DatasetStatus, ShardStatus


class Transition(StrEnum):
    """What can happen to a shard. The name is written into its event row."""

    CLAIM = "claim"
    FINISH = "finish"
    RETRY = "retry"
    FAIL = "fail"
    RELEASE = "release"
    EXPIRE = "expire"
    CANCEL = "cancel"
    REVIVE = "revive"


class DatasetEvent(StrEnum):
    """What can happen to a dataset as a whole."""

    CREATE = "create"
    TAKE_OVER = "take_over"
    REQUEST_CANCEL = "request_cancel"


_P, _L = ShardStatus.PENDING, ShardStatus.LEASED
_D, _F, _C = ShardStatus.DONE, ShardStatus.FAILED, ShardStatus.CANCELLED

TRANSITIONS: Mapping[Transition, tuple[frozenset[ShardStatus], ShardStatus]] = MappingProxyType(
    {
        Transition.CLAIM: (frozenset({_P}), _L),
        Transition.FINISH: (frozenset({_L}), _D),
        Transition.RETRY: (frozenset({_L}), _P),
        Transition.FAIL: (frozenset({_L}), _F),
        Transition.RELEASE: (frozenset({_L}), _P),
        Transition.EXPIRE: (frozenset({_L}), _P),
        Transition.CANCEL: (frozenset({_P, _L}), _C),
        Transition.REVIVE: (frozenset({_F}), _P),
    }
)
"""For each transition: the states it may start from, and the state it leads to.

RETRY is a failed attempt with tries left, FAIL the last one; EXPIRE is a lease that ran out with
tries left (without, it is FAIL); RELEASE is a worker that drains; REVIVE is a user's retry.
"""


def sources(transition: Transition) -> frozenset[ShardStatus]:
    """Return the states from which a transition may start."""
    return TRANSITIONS[transition][0]


def target(transition: Transition) -> ShardStatus:
    """Return the state to which a transition leads."""
    return TRANSITIONS[transition][1]


def dataset_status(
    shards: Mapping[ShardStatus, int], *, cancel_requested: bool, images_missing: bool = False
) -> DatasetStatus:
    """Derive a dataset's state from its numbers of shards by state.

    images_missing: a done shard has gaps.
    """
    total = sum(shards.values())
    done = shards.get(_D, 0)
    if done == total:
        return DatasetStatus.COMPLETE_WITH_GAPS if images_missing else DatasetStatus.COMPLETE
    if cancel_requested:
        return DatasetStatus.CANCELLED
    if shards.get(_P, 0) == total:
        return DatasetStatus.PENDING
    if shards.get(_P, 0) or shards.get(_L, 0):
        return DatasetStatus.RUNNING
    return DatasetStatus.FAILED
