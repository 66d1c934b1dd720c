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
from hi5_common.domain.planning.terms import Limits, Term

SMALLEST, LOOKED_AT = 3, 100
"""All sets of so many demands or fewer are looked through for the smallest that clash, if there are
so many sets or fewer; else demands are left out one by one."""
_FITTINGS = 200
_TIES = 1e-3
"""What an image of a combination costs at most, in distances: it makes one of several equally good
answers the best. (Noise in the weight of distances would not, where a half is rounded.)"""
_SCALE = 1e3
"""Of costs: the solver takes answers that are less than a millionth apart for equally good."""
_FOUND, _NONE = 0, 2
"""What SciPy's `milp` says where it has the best answer, and where there is none."""


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

    @cached_property
    def combinations(self) -> Ints:
        """Return every combination (cells, strands) of value numbers."""
        ranges = [range(strand.size) for strand in self.strands]
        return np.array(list(itertools.product(*ranges)), dtype=np.int64)

    def solved(self, rng: np.random.Generator) -> Ints | None:
        """Return the images (cells,) of every combination; None if the demands clash."""
        ties = _TIES * rng.random(len(self.combinations))
        return self._program(range(len(self.demands)), self.expected, ties)

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
        import scipy.sparse as sp

        cells = len(self.combinations)
        slacks = [demand.slack for demand in self.demands]
        rows, low, high = zip(*self._exact(range(len(slacks))), strict=True)
        none = sp.csr_matrix((rows[0].shape[0], 0))
        columns = sp.block_diag([none, *(slack.columns for slack in slacks)])
        table = sp.hstack([sp.vstack(rows), columns])
        costs = np.concatenate([np.zeros(cells), *(slack.costs for slack in slacks)])
        whole = [np.full(len(slack.costs), float(slack.whole)) for slack in slacks]
        found = _solved(
            costs,
            np.full_like(costs, np.inf),
            [(table, np.concatenate(low), np.concatenate(high))],
            np.concatenate([np.ones(cells), *whole]),
        )
        if found is None:
            return None
        return tuple(demand.nearest(self.combinations, found[:cells]) for demand in self.demands)

    def _possible(self, numbers: Sequence[int]) -> bool:
        nothing = np.zeros(len(self.combinations))
        most = np.full_like(nothing, self.count)
        return _solved(nothing, most, self._exact(numbers)) is not None

    def _exact(self, numbers: Sequence[int]) -> list[Limits]:
        """Return the limits that the attributes' counts and demands set: rows, least and most."""
        return [self._margins, *(self._limits[number] for number in numbers)]

    @cached_property
    def _limits(self) -> list[Limits]:
        return [demand.limits(self.combinations) for demand in self.demands]

    def _program(self, numbers: Sequence[int], wanted: Floats, ties: Floats) -> Ints | None:
        """Return whole numbers (cells,) near `wanted`: the sum of distances, with `ties`, is least.

        Each is the whole part of what is wanted, less some images, with the one that rounds it up,
        and more: whole numbers alone, of which the solver's answer is exact.
        """
        import scipy.sparse as sp

        whole = np.floor(wanted)
        limits = [
            (sp.hstack([-rows, rows, rows]), low - rows @ whole, high - rows @ whole)
            for rows, low, high in self._exact(numbers)
        ]
        up_costs = 1.0 - 2.0 * (wanted - whole)
        costs = _SCALE * np.concatenate([1.0 - ties, up_costs + ties, 1.0 + ties])
        most = np.concatenate([whole, np.ones_like(whole), np.full_like(whole, self.count)])
        found = _solved(costs, most, limits)
        if found is None:
            return None
        less, up, more = np.split(found, 3)
        return whole.astype(np.int64) - less + up + more

    @cached_property
    def _margins(self) -> Limits:
        """Return rows (values, cells), and the fewest and the most images of each value."""
        import scipy.sparse as sp

        rows, low, high = [np.ones(len(self.combinations))], [self.count], [self.count]
        for place, strand in enumerate(self.strands):
            share, extra = divmod(self.count, strand.size)
            for value in range(strand.size if place not in self.free else 0):
                rows.append((self.combinations[:, place] == value).astype(np.float64))
                given = None if strand.counts is None else int(strand.counts[value])
                low.append(share if given is None else given)
                high.append(share + bool(extra) if given is None else given)
        return sp.csr_matrix(np.array(rows)), np.array(low, float), np.array(high, float)

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


def _solved(
    costs: Floats, most: Floats, limits: Sequence[Limits], whole: Floats | None = None
) -> Ints | None:
    """Return the whole numbers from 0 to `most` whose cost is least; None if there are none.

    Where `whole` is 0 they need not be whole, and are rounded. Raises RuntimeError where the solver
    cannot tell.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    found = milp(
        costs,
        integrality=np.ones_like(costs) if whole is None else whole,
        bounds=Bounds(0, most),
        constraints=[LinearConstraint(*limit) for limit in limits],
        options={"mip_rel_gap": 0.0},
    )
    if found.status not in (_FOUND, _NONE):
        raise RuntimeError(f"the solver gave no answer: {found.message}")
    return None if found.status == _NONE else np.rint(found.x).astype(np.int64)


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
