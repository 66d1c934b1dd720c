import pytest

from hi5_common.domain import lifecycle
from hi5_common.domain.lifecycle import TRANSITIONS, Transition
from hi5_common.domain.records import DatasetStatus, ShardStatus

P, L = ShardStatus.PENDING, ShardStatus.LEASED
D, F, C = ShardStatus.DONE, ShardStatus.FAILED, ShardStatus.CANCELLED


def test_every_transition_stands_in_the_table() -> None:
    assert set(TRANSITIONS) == set(Transition)


def test_what_is_published_stays_published() -> None:
    assert not [name for name in Transition if D in lifecycle.sources(name)]


def test_only_a_lease_can_publish() -> None:
    assert [name for name in Transition if lifecycle.target(name) is D] == [Transition.FINISH]
    assert lifecycle.sources(Transition.FINISH) == {L}


def test_only_a_users_retry_leaves_a_terminal_state() -> None:
    leaving = [name for name in Transition if lifecycle.sources(name) & {D, F, C}]
    assert leaving == [Transition.REVIVE]


@pytest.mark.parametrize(
    ("shards", "cancelled", "expected"),
    [
        ({P: 3}, False, DatasetStatus.PENDING),
        ({P: 2, L: 1}, False, DatasetStatus.RUNNING),
        ({P: 2, D: 1}, False, DatasetStatus.RUNNING),
        ({L: 1, F: 1}, False, DatasetStatus.RUNNING),
        ({D: 2, F: 1}, False, DatasetStatus.FAILED),
        ({D: 3}, False, DatasetStatus.COMPLETE),
        ({D: 3}, True, DatasetStatus.COMPLETE),
        ({D: 1, C: 2}, True, DatasetStatus.CANCELLED),
        ({L: 1, C: 2}, True, DatasetStatus.CANCELLED),
    ],
)
def test_a_dataset_is_what_its_shards_are(
    shards: dict[ShardStatus, int], cancelled: bool, expected: DatasetStatus
) -> None:
    assert lifecycle.dataset_status(shards, cancel_requested=cancelled) is expected
