"""How many images each combination of some attributes gets, when a spec demands some of them.

Whole numbers for every combination, so that each attribute's counts and every demand are met, and
the rest is as near to independent as that allows: a small mixed-integer program, solved by HiGHS.
"""

import itertools
import math
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hi5_common.domain.planning.strand import Floats, Ints, Strand
from hi5_common.domain.planning.table import Bounds, Table
from hi5_common.domain.planning.terms import Conditional, Limits, Term

SMALLEST, LOOKED_AT = 3, 100
"""All sets of so many demands or fewer are looked through for the smallest that clash, if there are
so many sets or fewer; else demands are left out one by one."""
_FITTINGS = 200
_TIES = 1e-3
"""What an image of a combination costs at most, in distances: it makes one of several equally good
answers the best. (Noise in the weight of distances would not, where a half is rounded.)"""


@dataclass(frozen=True, eq=False)
class Linked:
    """Strands that demands link, and the number of images. Places of demands are in `strands`.

    free: places of strands of which nothing is asked but what demands make of them.
    """

    strands: tuple[Strand, ...]
    demands: tuple[Term, ...]
    count: int
    free: frozenset[int] = frozenset()

    @cached_property
    def _key(self) -> tuple[object, ...]:
        strands = tuple(
            (strand.size, None if strand.counts is None else tuple(strand.counts.tolist()))
            for strand in self.strands
        )
        demands = tuple((type(demand), demand.key) for demand in self.demands)
        return strands, demands, self.count, self.free

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Linked) and self._key == other._key

    @property
    def combinations(self) -> Ints:
        """Return every combination (cells, strands) of value numbers."""
        return self._table.cells

    @property
    def classes(self) -> int:
        """Return how many combinations of classes there are: no demand tells their values apart."""
        return math.prod(self._coarse.sizes)

    def solved(self, rng: np.random.Generator) -> Ints | None:
        """Return the images (cells,) of every combination; None if the demands clash."""
        ties = _TIES * rng.random(len(self.combinations))
        limits = self._table.limits(range(len(self.demands)))
        if any(isinstance(demand, Conditional) for demand in self.demands):
            found = self._of_classes(ties)
            if found is None:
                return None
            limits = [self._table.margins, found]
        return self._table.near(self.expected, ties, limits)

    def _of_classes(self, ties: Floats) -> Limits | None:
        """Return as limits the images of every combination of classes; None if demands clash.

        Shares among many values make a hard program: of a few classes it is an easy one, and what
        is left is to deal the images of a class out to its values.
        """
        import scipy.sparse as sp

        coarse, codes = self._coarse, self._codes
        expected = np.bincount(codes, weights=self.expected, minlength=len(coarse.cells))
        own = ties[np.unique(codes, return_index=True)[1]]
        images = coarse.near(expected, own, coarse.limits(range(len(self.demands))))
        if images is None:
            return None
        ones, places = np.ones(len(codes)), np.arange(len(codes))
        rows = sp.csr_matrix((ones, (codes, places)), shape=(len(images), len(codes)))
        return rows, images.astype(np.float64), images.astype(np.float64)

    def clash(self) -> tuple[int, ...]:
        """Return the numbers of demands that cannot be met together; empty if all can.

        Without any one of them the others could be met.
        """
        every = range(len(self.demands))
        if self._possible(every):
            return ()
        sizes = range(1, SMALLEST + 1)
        if sum(math.comb(len(self.demands), size) for size in sizes) <= LOOKED_AT:
            sets = (itertools.combinations(every, size) for size in sizes)
            for few in itertools.chain.from_iterable(sets):
                if not self._possible(few):
                    return few
        left = list(every)
        for number in every:
            without = [other for other in left if other != number]
            if not self._possible(without):
                left = without
        return tuple(left)

    def nearest(self) -> tuple[int | tuple[int, ...] | None, ...] | None:
        """Return what of the demands can be met, changed by as few images as possible.

        None if the attributes' own counts do not go together, whatever is demanded.
        """
        return self._coarse.nearest()

    def _possible(self, numbers: Sequence[int]) -> bool:
        return self._coarse.possible(numbers)

    @cached_property
    def _table(self) -> Table:
        bounds = tuple(
            None if place in self.free else _bounds(strand, self.count, np.arange(strand.size))
            for place, strand in enumerate(self.strands)
        )
        return Table(tuple(s.size for s in self.strands), bounds, self.demands, self.count)

    @cached_property
    def _coarse(self) -> Table:
        """Return the table of classes: it can be met just when that of all values can.

        For what is asked of a class is asked of none of its values, whose own counts any images
        of the class may be dealt out to.
        """
        classes = self._classes
        bounds = tuple(
            None if place in self.free else _bounds(strand, self.count, classes[place])
            for place, strand in enumerate(self.strands)
        )
        terms = tuple(demand.coarse(classes) for demand in self.demands)
        return Table(tuple(int(c.max()) + 1 for c in classes), bounds, terms, self.count)

    @cached_property
    def _codes(self) -> Ints:
        """Return the combination of classes (cells,) that each combination of values is of."""
        columns = zip(self._classes, self.combinations.T, strict=True)
        places = tuple(classes[column] for classes, column in columns)
        return np.asarray(np.ravel_multi_index(places, self._coarse.sizes), dtype=np.int64)

    @cached_property
    def _classes(self) -> tuple[Ints, ...]:
        """Return the class (n,) of each value of every strand: no demand tells its values apart."""
        found = []
        for place, strand in enumerate(self.strands):
            marks = np.array([demand.marks(place, strand.size) for demand in self.demands])
            if any(len(np.unique(row)) == strand.size for row in marks):
                found.append(np.arange(strand.size))
            else:
                found.append(np.unique(marks, axis=1, return_inverse=True)[1].reshape(-1))
        return tuple(found)

    @cached_property
    def expected(self) -> Floats:
        """Return shares of the images (cells,): independent, then fitted to demands and counts."""
        shares = [strand.shares for strand in self.strands]
        cells = np.full(len(self.combinations), float(self.count))
        for place, share in enumerate(shares):
            cells *= share[self.combinations[:, place]]
        fits = [demand.fitting(self.combinations, self.count) for demand in self.demands]
        for _ in range(_FITTINGS):
            before = cells.copy()
            for fit in fits:
                fit(cells)
            for place, share in enumerate(shares):
                if place in self.free:
                    continue
                column = self.combinations[:, place]
                sums = np.bincount(column, weights=cells, minlength=len(share))
                ratios = np.divide(
                    self.count * share, sums, out=np.zeros_like(sums), where=sums > 0
                )
                cells *= ratios[column]
            if np.abs(cells - before).max() < 1e-6:
                break
        return cells


def _bounds(strand: Strand, count: int, classes: Ints) -> Bounds:
    """Return the fewest and the most images of each class of a strand's values."""
    if strand.counts is not None:
        exact = np.bincount(classes, weights=strand.counts).astype(np.int64)
        return exact, exact
    share, extra = divmod(count, strand.size)
    sizes = np.bincount(classes)
    fewest = np.maximum(0, extra - (strand.size - sizes))
    return share * sizes + fewest, share * sizes + np.minimum(sizes, extra)


def links(linked: Sequence[AbstractSet[int]]) -> list[tuple[tuple[int, ...], list[int]]]:
    """Return groups of places that are linked, in order, with the numbers of what links them."""
    groups: list[tuple[set[int], list[int]]] = []
    for number, these in enumerate(linked):
        places, numbers = set(these), [number]
        for group in [group for group in groups if group[0] & places]:
            places |= group[0]
            numbers = group[1] + numbers
            groups.remove(group)
        groups.append((places, sorted(numbers)))
    return [(tuple(sorted(places)), numbers) for places, numbers in groups]
