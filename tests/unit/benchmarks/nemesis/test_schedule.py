"""Which fault comes when is a function of the seed."""

from itertools import islice

from benchmarks.nemesis.faults import _ACTS
from benchmarks.nemesis.schedule import FaultKind, strikes


def test_a_seed_replays() -> None:
    first, again = (list(islice(strikes(3), 50)) for _ in range(2))
    assert first == again
    assert first != list(islice(strikes(4), 50))
    assert [strike.number for strike in first] == list(range(50))


def test_every_kind_comes() -> None:
    assert {strike.kind for strike in islice(strikes(1), 500)} == set(FaultKind)


def test_every_kind_can_be_done() -> None:
    assert _ACTS.keys() == set(FaultKind)
