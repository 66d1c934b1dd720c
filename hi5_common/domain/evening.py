"""Evening out pairs: exchange values between joint cells until every pair of values is fair.

Swapping the values of one attribute between two images leaves every attribute's counts as they
are and moves pairs only. Swaps are taken, always the best one for the pair that is furthest off,
as long as the squared deviations of all pairs shrink and no joint cell strays from its share by an
image or more. Elementwise IEEE arithmetic in a fixed order: every machine takes the same swaps.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hi5_common.domain.apportion import Ints

Floats = npt.NDArray[np.float64]

FAIR = 1.0
"""A pair within one image of its expectation is left alone."""
LOOKED_AT = 400
CANDIDATES = 12
PARTNERS = 6
MAX_PASSES = 12
LEAST_TRIES = 1500
TRIES_PER_CELL = 13
"""Times the mean size of the pairs' tables: with 111 environments 1,500 tries leave a pair of
10,000 images 1.96 from its expectation, 6,000 leave it 1.01, and more change nothing."""
_TINY = 1e-9
_NUMBER = np.dtype(">u2")
"""Value numbers, most significant byte first: no attribute has 65,536 values."""


@dataclass(frozen=True)
class Gap:
    """A pair of values that comes too often or too seldom: attribute a at x with b at y."""

    a: int
    x: int
    b: int
    y: int


class Cells:
    """Joint cells with their sizes and the deviation of every pair from its expectation."""

    def __init__(self, path: Ints, size: Ints, shares: Sequence[Ints]) -> None:
        self._shares = shares
        self._total = int(size.sum())
        self._sizes = dict(zip(_keys(path), size.tolist(), strict=True))
        self._columns = np.ascontiguousarray(path.T.astype(_NUMBER))
        self._off = {pair: self._deviation(size, *pair) for pair in self._pairs()}

    def sorted_cells(self) -> tuple[Ints, Ints]:
        """Return the cells in use, in the order of their values, and their sizes."""
        used = sorted((key, size) for key, size in self._sizes.items() if size)
        path = np.frombuffer(b"".join(key for key, _ in used), _NUMBER)
        sizes = np.array([size for _, size in used], np.int64)
        return path.reshape(len(used), -1).astype(np.int64), sizes

    def gaps(self) -> list[Gap]:
        """List pairs that come too often or too seldom, both ways round, the furthest off first."""
        found = []
        for (a, b), off in self._off.items():
            for x, y in np.argwhere(np.abs(off) >= FAIR - _TINY).tolist():
                found.append((-abs(off[x, y]), a, x, b, y))
        return [
            gap for _, a, x, b, y in sorted(found) for gap in (Gap(a, x, b, y), Gap(b, y, a, x))
        ]

    def close(self, gap: Gap) -> bool:
        """Swap values of attribute b so that the gap shrinks; False if no swap helps."""
        off = self._table(gap.b, gap.a)[:, gap.x]
        if abs(off[gap.y]) < FAIR - _TINY:
            return False
        too_many = off[gap.y] > 0
        for other in np.argsort(off if too_many else -off, kind="stable")[:PARTNERS].tolist():
            if other != gap.y and (off[other] < off[gap.y]) == too_many:
                high, low = (gap.y, other) if too_many else (other, gap.y)
                if self._swap(gap, high, low):
                    return True
        return False

    def _swap(self, gap: Gap, high: int, low: int) -> bool:
        """Give one image with (x, high) the value low, and one without x the value high."""
        with_x, values = self._columns[gap.a] == gap.x, self._columns[gap.b]
        givers = self._ranked(with_x & (values == high), gap.b, high, low)
        takers = self._ranked(~with_x & (values == low), gap.b, low, high)
        best, chosen = -_TINY, None
        for (gain_u, u), (gain_v, v) in itertools.product(givers, takers):
            apart = sum(i != j for c, (i, j) in enumerate(zip(u, v, strict=True)) if c != gap.b)
            change = 2.0 * (gain_u + gain_v) + 4.0 * apart
            if change < best:
                best, chosen = change, (u, v)
        if chosen is None:
            return False
        self._exchange(*chosen, gap.b, high, low)
        return True

    def _ranked(
        self, rows: npt.NDArray[np.bool_], b: int, old: int, new: int
    ) -> list[tuple[float, tuple[int, ...]]]:
        """Rank cells by how much changing b from old to new would help their other pairs."""
        cells = np.flatnonzero(rows)
        change = np.zeros(len(cells))
        for c, column in enumerate(self._columns):
            if c != b:
                off = self._table(b, c)
                change = change + (off[new] - off[old])[column[cells]]
        order = np.argsort(change, kind="stable")[:LOOKED_AT]
        paths = self._columns[:, cells[order]].T.tolist()
        ranked = zip(change[order].tolist(), map(tuple, paths), strict=True)
        movable = (entry for entry in ranked if self._may_move(entry[1], b, new))
        return list(itertools.islice(movable, CANDIDATES))

    def _may_move(self, cell: tuple[int, ...], b: int, new: int) -> bool:
        """Tell whether one image may leave a cell for the one with another value of b."""
        return self._may_change(cell, -1) and self._may_change(_with(cell, b, new), 1)

    def _may_change(self, cell: tuple[int, ...], step: int) -> bool:
        size = self._sizes.get(_key(cell), 0)
        off = size - self._expected(cell)
        closer = abs(off + step) < FAIR - _TINY or abs(off + step) <= abs(off)
        return bool(closer) and size + step >= 0

    def _exchange(
        self, u: tuple[int, ...], v: tuple[int, ...], b: int, high: int, low: int
    ) -> None:
        for cell, old, new in ((u, high, low), (v, low, high)):
            target = _with(cell, b, new)
            self._sizes[_key(cell)] -= 1
            if _key(target) not in self._sizes:
                added = np.array(target, _NUMBER)[:, None]
                self._columns = np.concatenate([self._columns, added], axis=1)
            self._sizes[_key(target)] = self._sizes.get(_key(target), 0) + 1
            for c, value in enumerate(cell):
                if c != b:
                    off = self._table(b, c)
                    off[old, value] -= 1.0
                    off[new, value] += 1.0

    def _expected(self, cell: tuple[int, ...]) -> float:
        expected = float(self._total)
        for counts, value in zip(self._shares, cell, strict=True):
            expected *= float(counts[value]) / self._total
        return expected

    def _pairs(self) -> Iterator[tuple[int, int]]:
        return itertools.combinations(range(len(self._shares)), 2)

    def _table(self, a: int, b: int) -> Floats:
        """Return the deviations (values of a, values of b), a view either way round."""
        return self._off[a, b] if a < b else self._off[b, a].T

    def _deviation(self, size: Ints, a: int, b: int) -> Floats:
        shape = self._shares[a].size, self._shares[b].size
        pair = self._columns[a].astype(np.int64) * shape[1] + self._columns[b]
        counts = np.bincount(pair, weights=size, minlength=shape[0] * shape[1]).reshape(shape)
        return counts - np.outer(self._shares[a], self._shares[b]) / self._total


def even_pairs(path: Ints, size: Ints, shares: Sequence[Ints]) -> tuple[Ints, Ints]:
    """Return joint cells whose pairs are fairer: same attributes' counts, other combinations.

    path (cells, attributes) value numbers, size (cells,), shares the counts of each attribute.
    """
    cells = Cells(path, size, shares)
    tables = [a.size * b.size for a, b in itertools.combinations(shares, 2)]
    tries = max(LEAST_TRIES, TRIES_PER_CELL * sum(tables) // len(tables))
    for _ in range(MAX_PASSES):
        gaps = cells.gaps()[:tries]
        tries -= len(gaps)
        closed = [cells.close(gap) for gap in gaps]
        if not any(closed):
            break
    return cells.sorted_cells()


def _with(cell: tuple[int, ...], position: int, value: int) -> tuple[int, ...]:
    return (*cell[:position], value, *cell[position + 1 :])


def _keys(path: Ints) -> list[bytes]:
    """Return the keys of many cells (cells, attributes): see _key."""
    data, width = path.astype(_NUMBER).tobytes(), path.shape[1] * _NUMBER.itemsize
    return [data[start : start + width] for start in range(0, len(data), width)]


def _key(cell: tuple[int, ...]) -> bytes:
    """Return a cell as bytes that sort as it does: a third of a tuple's memory."""
    return b"".join(value.to_bytes(_NUMBER.itemsize) for value in cell)
