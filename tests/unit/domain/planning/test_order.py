"""Orders hold their counts at any length, and arithmetic goes on where weaving stops."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.plan_evenness import furthest_beginning
from hi5_common.domain.planning import order as orders
from hi5_common.domain.planning.order import Order, Periodic, Repeated, order_of
from hi5_common.domain.planning.sizes import joint_extremes, pair_sizes, value_sizes
from hi5_common.domain.planning.strand import Ints, Strand

STRAY, PAIRS = 2.0, 2.0
"""Images that a running count may be off its share, and a pair off its expectation."""


def rows_of(order: Order, count: int) -> Ints:
    return order.rows(np.arange(count, dtype=np.int64)).astype(np.int64)


def furthest_pair(rows: Ints) -> float:
    worst = 0.0
    for a, b in itertools.combinations(rows.T, 2):
        met = np.zeros((int(a.max()) + 1, int(b.max()) + 1))
        np.add.at(met, (a, b), 1.0)
        fair = np.outer(met.sum(axis=1), met.sum(axis=0)) / len(rows)
        worst = max(worst, float(np.abs(met - fair).max()))
    return worst


@st.composite
def requests(draw: st.DrawFn) -> tuple[list[Strand], int]:
    count = draw(st.integers(1, 300))
    strands = []
    for _ in range(draw(st.integers(2, 6))):
        size = draw(st.integers(1, 20))
        if draw(st.booleans()):
            strands.append(Strand(size))
        else:
            cuts = sorted(
                draw(st.lists(st.integers(0, count), min_size=size - 1, max_size=size - 1))
            )
            strands.append(Strand(size, np.diff([0, *cuts, count]).astype(np.int64)))
    return strands, count


@settings(max_examples=150, deadline=None)
@given(requests(), st.integers(0, 2**32))
def test_counts_are_exact_and_every_beginning_is_fair(
    asked: tuple[list[Strand], int], seed: int
) -> None:
    strands, count = asked
    order = order_of(strands, count, np.random.default_rng(seed))
    rows = rows_of(order, count)
    for place, strand in enumerate(strands):
        sizes = value_sizes(order, place)
        assert sizes.tolist() == np.bincount(rows[:, place], minlength=strand.size).tolist()
        if strand.counts is None:
            assert np.ptp(sizes) <= 1
        else:
            assert sizes.tolist() == strand.counts.tolist()
    assert furthest_beginning(order, count) <= STRAY + 1e-9
    assert furthest_pair(rows) <= PAIRS
    again = order_of(strands, count, np.random.default_rng(seed))
    assert np.array_equal(rows_of(again, count), rows)


def test_a_period_has_every_combination_once() -> None:
    sizes = (2, 6, 4, 3)
    order = Periodic(np.zeros((0, 4), np.uint16), sizes, 2)
    rows = rows_of(order, 2 * math.prod(sizes))
    assert len(np.unique(rows[: math.prod(sizes)], axis=0)) == math.prod(sizes)
    assert np.array_equal(rows[: math.prod(sizes)], rows[math.prod(sizes) :])
    assert furthest_beginning(order, len(rows)) <= 1.0


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(orders, "WOVEN", 1000)


@pytest.mark.usefixtures("short")
@pytest.mark.parametrize("count", [1001, 2345, 20_000])
def test_periods_go_on_where_weaving_stops(count: int) -> None:
    order = order_of([Strand(2), Strand(5), Strand(7)], count, np.random.default_rng(1))
    assert isinstance(order, Periodic)
    assert order.periods > 0
    rows = rows_of(order, count)
    assert furthest_beginning(order, count) <= STRAY
    assert furthest_pair(rows) <= PAIRS
    assert all(np.ptp(value_sizes(order, place)) <= 1 for place in range(3))
    met = np.zeros((5, 7), np.int64)
    np.add.at(met, (rows[:, 1], rows[:, 2]), 1)
    assert np.array_equal(pair_sizes(order, 1, 2), met)
    _, cells = np.unique(rows, axis=0, return_counts=True)
    assert joint_extremes(order) == (int(cells.min()), int(cells.max()))


@pytest.mark.usefixtures("short")
def test_unequal_counts_are_repeated_exactly() -> None:
    counts = [np.array(c, np.int64) for c in ((7001, 12_999), (1, 4321, 15_678))]
    order = order_of(
        [Strand(2, counts[0]), Strand(3, counts[1]), Strand(4)], 20_000, np.random.default_rng(1)
    )
    assert isinstance(order, Repeated)
    rows = rows_of(order, 20_000)
    for place in (0, 1):
        assert np.bincount(rows[:, place]).tolist() == counts[place].tolist()
        assert value_sizes(order, place).tolist() == counts[place].tolist()
    assert np.ptp(np.bincount(rows[:, 2])) <= 1
    _, cells = np.unique(rows, axis=0, return_counts=True)
    assert joint_extremes(order)[1] == cells.max()
    assert furthest_beginning(order, 20_000) <= 2 * STRAY


def test_golden_orders() -> None:
    """These rows may only change together with plan.ALGORITHM."""
    counts = np.array([700, 299, 1], np.int64)
    strands = [Strand(2), Strand(3, counts), Strand(44), Strand(111)]
    rows = rows_of(order_of(strands, 1000, np.random.default_rng(0)), 1000)
    assert rows[[0, 1, 500, 999]].tolist() == GOLDEN


GOLDEN = [[1, 0, 7, 10], [0, 1, 5, 37], [1, 0, 39, 53], [0, 0, 4, 10]]
