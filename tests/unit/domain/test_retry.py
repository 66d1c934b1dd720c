import pytest

from hi5_common.domain.retry import (
    LONGEST_DELAY_S,
    MAX_FAILURES,
    MAX_STORE_FAILURES,
    FailureKind,
    GiveUp,
    RetryLater,
    decide,
)


def test_delays_double_up_to_a_bound() -> None:
    delays = [decide(FailureKind.WORKER, failures) for failures in range(1, MAX_FAILURES)]
    assert delays == [RetryLater(5), RetryLater(10), RetryLater(20), RetryLater(40)]
    assert all(
        delay.delay_s <= LONGEST_DELAY_S for delay in delays if isinstance(delay, RetryLater)
    )


@pytest.mark.parametrize("kind", list(FailureKind))
def test_every_kind_of_failure_ends(kind: FailureKind) -> None:
    assert decide(kind, MAX_STORE_FAILURES) == GiveUp()


@pytest.mark.parametrize("kind", sorted(set(FailureKind) - {FailureKind.STORE}))
def test_all_but_a_store_that_is_away_end_soon(kind: FailureKind) -> None:
    assert decide(kind, MAX_FAILURES) == GiveUp()


def test_a_store_may_be_away_for_hours() -> None:
    delays = [decide(FailureKind.STORE, n) for n in range(1, MAX_STORE_FAILURES)]
    waits = [each.delay_s for each in delays if isinstance(each, RetryLater)]
    assert len(waits) == len(delays)
    assert 3 * 3600 < sum(waits) < 6 * 3600


def test_a_lost_machine_costs_no_time_the_first_time() -> None:
    assert decide(FailureKind.LEASE_EXPIRED, 1) == RetryLater(0)
    assert decide(FailureKind.LEASE_EXPIRED, 2) == RetryLater(10)


def test_an_image_that_cannot_be_made_is_not_tried_again() -> None:
    assert decide(FailureKind.IMAGE, 1) == GiveUp()
