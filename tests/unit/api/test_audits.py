"""Audits are made one at a time, once each, and only as many kept or waited for as is said."""

from collections.abc import Callable, Iterator
from threading import Event
from uuid import UUID

import pytest

from hi5_common.domain.errors import PermanentError, TransientError
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.fairness.observed import Observed
from hi5_common.fairness.report import Fairness, fairness
from services.api.audit.audits import ABANDONED_S, KEPT, MOST_WAITING, Audits, Settled, Stopped

SPEC = parse_spec({"count": 4, "images_per_shard": 4, "image": {"width": 64, "height": 48}})
EMPTY = fairness(Observed(SPEC), Plan.of(SPEC))
SOME, MORE = Settled(1, 2), Settled(2, 4)
FAILED = Settled(1, 2, given_up=1)


class Maker:
    """Makes audits when it is let, notes of which datasets, and fails as told."""

    def __init__(self) -> None:
        self.made: list[int] = []
        self.begun, self.let = Event(), Event()
        self.error: Exception | None = None

    def __call__(self, dataset_id: UUID, go_on: Callable[[], None]) -> Fairness:
        self.made.append(dataset_id.int)
        self.begun.set()
        while not self.let.wait(0.01):
            go_on()
        if self.error is not None:
            raise self.error
        return EMPTY


@pytest.fixture
def maker() -> Maker:
    return Maker()


class Clock:
    """Seconds that pass when they are told to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def audits(maker: Maker, clock: Clock) -> Iterator[Audits]:
    found = Audits(maker, clock)
    yield found
    found.close()


def idle(audits: Audits) -> None:
    """Wait until nothing is being made: the thread takes jobs in order."""
    audits._thread.submit(lambda: None).result(30)


def test_an_audit_holds_until_more_is_delivered(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    assert audits.of(UUID(int=1), SOME) is None
    idle(audits)
    assert audits.of(UUID(int=1), SOME) is EMPTY
    assert audits.of(UUID(int=1), MORE) is None
    idle(audits)
    assert audits.of(UUID(int=1), MORE) is EMPTY
    assert maker.made == [1, 1]


def test_an_earlier_one_will_do_where_that_is_said(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    audits.of(UUID(int=1), SOME)
    idle(audits)
    maker.let.clear()
    assert audits.of(UUID(int=1), MORE, or_earlier=True) is EMPTY
    assert audits.of(UUID(int=1), MORE) is None
    maker.let.set()
    idle(audits)
    assert audits.of(UUID(int=1), MORE) is EMPTY


def test_what_may_pass_is_raised_once_and_made_again(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    maker.error = TransientError("away")
    audits.of(UUID(int=1), SOME)
    idle(audits)
    with pytest.raises(TransientError, match="away"):
        audits.of(UUID(int=1), SOME)
    maker.error = None
    assert audits.of(UUID(int=1), SOME) is None
    idle(audits)
    assert audits.of(UUID(int=1), SOME) is EMPTY


def test_any_other_error_stands_until_more_is_delivered(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    maker.error = PermanentError("broken")
    audits.of(UUID(int=1), SOME)
    idle(audits)
    for _ in range(3):
        with pytest.raises(PermanentError, match="broken"):
            audits.of(UUID(int=1), SOME)
    maker.error = None
    assert audits.of(UUID(int=1), MORE, or_earlier=True) is None
    idle(audits)
    assert audits.of(UUID(int=1), MORE, or_earlier=True) is EMPTY
    assert maker.made == [1, 1]


def test_only_the_last_few_are_kept(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    for number in range(KEPT + 1):
        audits.of(UUID(int=number), SOME)
        idle(audits)
        assert audits.of(UUID(int=number), SOME) is EMPTY
    assert audits.of(UUID(int=KEPT), SOME) is EMPTY
    assert audits.of(UUID(int=1), SOME) is EMPTY
    assert audits.of(UUID(int=0), SOME) is None


def test_only_so_many_wait_and_the_others_are_not_begun(audits: Audits, maker: Maker) -> None:
    for number in range(MOST_WAITING + 5):
        assert audits.of(UUID(int=number), SOME) is None
    maker.let.set()
    idle(audits)
    assert maker.made == list(range(MOST_WAITING))
    assert audits.of(UUID(int=0), SOME) is EMPTY
    assert audits.of(UUID(int=MOST_WAITING), SOME) is None
    idle(audits)
    assert maker.made[-1] == MOST_WAITING


def test_all_who_ask_in_turn_get_theirs(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    waiting = list(range(2 * MOST_WAITING + KEPT))
    for _ in range(4):
        waiting = [number for number in waiting if audits.of(UUID(int=number), SOME) is None]
        idle(audits)
    assert waiting == []
    assert len(maker.made) == 2 * MOST_WAITING + KEPT


def test_who_does_not_come_back_keeps_nobody_waiting(
    audits: Audits, maker: Maker, clock: Clock
) -> None:
    maker.let.set()
    for number in range(MOST_WAITING):
        audits.of(UUID(int=number), SOME)
    idle(audits)
    last = UUID(int=MOST_WAITING)
    assert audits.of(last, SOME) is None
    idle(audits)
    assert audits.of(last, SOME) is None
    clock.now = ABANDONED_S
    assert audits.of(last, SOME) is None
    idle(audits)
    assert audits.of(last, SOME) is EMPTY
    assert len(audits._kept) == KEPT


def test_an_audit_ends_with_a_cancel_or_a_retry(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    for settled in (SOME, FAILED, SOME):
        assert audits.of(UUID(int=1), settled) is None
        idle(audits)
        assert audits.of(UUID(int=1), settled) is EMPTY
    assert maker.made == [1, 1, 1]


def test_before_a_retry_is_no_earlier_that_will_do(audits: Audits, maker: Maker) -> None:
    maker.let.set()
    audits.of(UUID(int=1), FAILED)
    idle(audits)
    assert audits.of(UUID(int=1), FAILED) is EMPTY
    assert audits.of(UUID(int=1), SOME, or_earlier=True) is None
    idle(audits)
    assert audits.of(UUID(int=1), FAILED, or_earlier=True) is EMPTY


def test_closing_ends_what_is_being_made(maker: Maker) -> None:
    audits = Audits(maker)
    audits.of(UUID(int=1), SOME)
    audits.of(UUID(int=2), SOME)
    assert maker.begun.wait(30)
    audits.close()
    assert maker.made == [1]
    with pytest.raises(Stopped):
        audits.of(UUID(int=1), SOME)
