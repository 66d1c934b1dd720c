"""Mend pairs of values that come too often or too seldom once all images are woven.

Two images exchange their values of one attribute: every count of values stays, pairs move. Taken is
the exchange that lowers a steep sum over all pairs most, among images so near to each other that no
running count of values strays from its share by more than STRAY images.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from hi5_common.domain.planning.strand import Floats, Ints, Table

FAIR = 1.0
"""A pair less than an image from its expectation is left alone: it has the floor or the ceiling."""
STRAY = 2.0
"""Images that a running count of a value may be off its share, where it is not further off."""
WINDOW = 1 << 14
"""Only among so many last images are values exchanged."""
TRIES_AT_ONE, TRIES_BEYOND = 150, 1000
"""Exchanges that are looked for, at most: for pairs an image off, with joint cells kept as even as
they are, and for those further off."""
TRIED = 8
"""Images that are tried as one side of an exchange for a pair, at most."""
PARTNERS = 12
"""Exchanges of an image that are weighed against running counts, at most: the best."""
REACH = 128
"""Images before and after, at most, among which the other side is looked for."""
_TINY = 1e-9
_ODD = 0x9E3779B97F4A7C15
"""Of 64 bits: its powers spread value numbers over them."""


class Pairs:
    """How far every pair of values of a table is from its expectation, in images."""

    def __init__(self, table: Table, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        every = combinations(range(len(sizes)), 2)
        self._off = {pair: self._tabled(table, *pair) for pair in every}
        self._growth: dict[tuple[int, int], tuple[Floats, Floats]] = {}

    def off(self, a: int, b: int) -> Floats:
        """Return (values of a, values of b), a view either way round."""
        return self._off[a, b] if a < b else self._off[b, a].T

    def growth(self, a: int, b: int) -> tuple[Floats, Floats]:
        """Return what one image more, and one fewer, of each pair adds to its fourth power."""
        if (a, b) not in self._growth:
            off = self.off(a, b)
            self._growth[a, b] = _more(off), _more(-off)
        return self._growth[a, b]

    def move(self, a: int, x: int, b: int, was: int, now: int) -> None:
        """Give an image that has x of strand a the value `now` of strand b instead of `was`."""
        off = self.off(a, b)
        off[x, was] -= 1.0
        off[x, now] += 1.0
        self._growth.pop((b, a), None)
        if (a, b) in self._growth:
            more, less = self._growth[a, b]
            for y in (was, now):
                more[x, y], less[x, y] = _more(off[x, y]), _more(-off[x, y])

    def worst(self) -> float:
        """Return how far the worst pair is off."""
        return max((float(np.abs(off).max()) for off in self._off.values()), default=0.0)

    def beyond(self, limit: float) -> Iterator[tuple[int, int, int, int]]:
        """Yield (a, x, b, y) of pairs that are so far off or more, the furthest first."""
        found = [
            (-abs(off[x, y]), a, int(x), b, int(y))
            for (a, b), off in self._off.items()
            for x, y in np.argwhere(np.abs(off) >= limit)
        ]
        yield from (gap[1:] for gap in sorted(found))

    def _tabled(self, table: Table, a: int, b: int) -> Floats:
        shape = self.sizes[a], self.sizes[b]
        code = table[:, a].astype(np.intp) * shape[1] + table[:, b]
        met = np.bincount(code, minlength=shape[0] * shape[1]).reshape(shape)
        return np.asarray(met - np.outer(met.sum(axis=1), met.sum(axis=0)) / len(table))


def mended(
    table: Table, sizes: Sequence[int], tied: Sequence[tuple[int, ...]] = (), kept: int = 0
) -> Table:
    """Return a table (images, strands) whose pairs are fair, or as nearly as was found.

    tied: strands that change places together; pairs among them are as they must be. The first
    `kept` images stay as they are: running counts are those of the images after them.
    """
    single = set(range(len(sizes))) - {place for places in tied for place in places}
    units = [*((place,) for place in sorted(single)), *tied]
    pairs, whole = Pairs(table, sizes), table.copy()
    if pairs.worst() < FAIR - _TINY:
        return whole
    columns = range(len(sizes))
    start = max(kept, len(table) - WINDOW)
    work = _Work(
        whole[start:],
        pairs,
        {k: unit for unit in units for k in unit},
        np.arange(start, len(table)) - kept + 1,
        [np.bincount(table[kept:start, k], minlength=sizes[k]) for k in columns],
        [np.bincount(table[kept:, k], minlength=sizes[k]) / (len(table) - kept) for k in columns],
        _codes(table[start:]),
    )
    for work.new_only, limit, work.tries in (
        (True, FAIR - _TINY, TRIES_AT_ONE),
        (False, FAIR + _TINY, TRIES_BEYOND),
    ):
        while work.brought_near(limit) and work.tries > 0:
            pass
    return whole


@dataclass(eq=False)
class _Work:
    table: Table
    """The last images."""
    pairs: Pairs
    unit: Mapping[int, tuple[int, ...]]
    """The strands that change places with a strand, itself among them."""
    numbers: Ints
    """How many images there are up to each of the last ones, itself counted."""
    before: Sequence[Ints]
    """Images of every value before the last ones, by strand."""
    shares: Sequence[Floats]
    codes: npt.NDArray[np.uint64]
    """A number for every image's combination."""
    new_only: bool = True
    """Make no combination that comes more often than those that it is made of."""
    tries: int = 0
    """Exchanges that may still be looked for."""

    def brought_near(self, limit: float) -> bool:
        """Look once at every pair that is so far off; tell whether any exchange was made."""
        changed = False
        for a, x, b, y in list(self.pairs.beyond(limit)):
            if b in self.unit[a]:
                continue
            while abs(self.pairs.off(a, b)[x, y]) >= limit and self.tries > 0:
                if not (self.exchange(a, x, b, y) or self.exchange(b, y, a, x)):
                    break
                changed = True
        return changed

    def exchange(self, a: int, x: int, b: int, y: int) -> bool:
        """Exchange values of b so that (x, y) comes nearer its expectation; False if none helps."""
        self.tries -= 1
        has, value = self.table[:, a] == x, self.table[:, b] == y
        too_many = self.pairs.off(a, b)[x, y] > 0
        one = np.flatnonzero(has & (value if too_many else ~value))
        spread = one[np.linspace(0, len(one) - 1, min(TRIED, len(one))).astype(np.intp)]
        for i in spread[::-1].tolist():
            near = slice(max(0, i - REACH), i + REACH + 1)
            other = ~has[near] & (~value[near] if too_many else value[near])
            others = near.start + np.flatnonzero(other)
            gain = self._change(b, i, others)
            for k in np.argsort(gain, kind="stable")[:PARTNERS].tolist():
                j = int(others[k])
                if gain[k] >= -_TINY:
                    break
                if self.new_only and not self._is_new(b, i, j):
                    continue
                if all(self._keeps(c, i, j) for c in self.unit[b]):
                    self._take(b, i, j)
                    return True
        return False

    def _is_new(self, b: int, i: int, j: int) -> bool:
        """Tell whether an exchange makes combinations that come less often than those it ends."""
        rows, unit = self.table[[i, j]], list(self.unit[b])
        rows[:, unit] = rows[::-1, unit]
        before = min(np.count_nonzero(self.codes == self.codes[row]) for row in (i, j))
        return all(np.count_nonzero(self.codes == code) < before for code in _codes(rows))

    def _change(self, b: int, i: int, others: Ints) -> Floats:
        """Return by how much each exchange (K,) changes the sum of fourth powers."""
        change = np.zeros(len(others))
        for moved in self.unit[b]:
            old, new = int(self.table[i, moved]), self.table[others, moved]
            part = np.zeros(len(others))
            for c in self._beside(b):
                more, less = self.pairs.growth(c, moved)
                u, v = int(self.table[i, c]), self.table[others, c]
                of_c = less[u, old] + more[u, new] + less[v, new] + more[v, old]
                part += np.where(v == u, 0.0, of_c)
            change += np.where(new == old, 0.0, part)
        return change

    def _keeps(self, b: int, i: int, j: int) -> bool:
        """Tell whether running counts stay as near their shares as they must, or come nearer."""
        first, last = min(i, j), max(i, j)
        column = self.table[:, b]
        if column[first] == column[last]:
            return True
        for value, step in ((column[first], -1.0), (column[last], 1.0)):
            is_value = column[:last] == value
            came = self.before[b][value] + np.count_nonzero(is_value[:first])
            came = came + np.cumsum(is_value[first:])
            off = came - self.numbers[first:last] * self.shares[b][value]
            if (np.abs(off + step) > np.maximum(STRAY, np.abs(off)) + _TINY).any():
                return False
        return True

    def _take(self, b: int, i: int, j: int) -> None:
        for moved in self.unit[b]:
            old, new = int(self.table[i, moved]), int(self.table[j, moved])
            for row, was, now in ((i, old, new), (j, new, old)):
                for c in self._beside(b):
                    self.pairs.move(c, int(self.table[row, c]), moved, was, now)
                self.table[row, moved] = now
        self.codes[[i, j]] = _codes(self.table[[i, j]])

    def _beside(self, b: int) -> list[int]:
        """Return the strands that do not change places with b."""
        return [c for c in range(self.table.shape[1]) if c not in self.unit[b]]


def _codes(rows: Table) -> npt.NDArray[np.uint64]:
    """Return a number for each row's combination: different ones hardly ever share one."""
    weights = np.cumprod(np.full(rows.shape[1], _ODD, dtype=np.uint64))
    return np.asarray((rows.astype(np.uint64) * weights).sum(axis=1), dtype=np.uint64)


def _more(off: Floats) -> Floats:
    """Return by how much the fourth power grows when a distance grows by one."""
    return ((4.0 * off + 6.0) * off + 4.0) * off + 1.0
