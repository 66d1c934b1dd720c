"""How many images each combination of some attributes gets, when a spec demands some of them.

Whole numbers for every combination, so that each attribute's counts and every demand are met, and
the rest is as near to independent as that allows: a small mixed-integer program, solved by HiGHS.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hi5_common.domain.planning.strand import Floats, Ints, Strand

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


@dataclass(frozen=True)
class Demand:
    """So many images shall have values that are all among those listed, by number of a strand."""

    values: Mapping[int, frozenset[int]]
    count: int


@dataclass(frozen=True, eq=False)
class Linked:
    """Strands that demands link, and the number of images. Places of demands are in `strands`."""

    strands: tuple[Strand, ...]
    demands: tuple[Demand, ...]
    count: int

    @cached_property
    def _key(self) -> tuple[object, ...]:
        strands = tuple(
            (strand.size, None if strand.counts is None else tuple(strand.counts.tolist()))
            for strand in self.strands
        )
        demands = tuple((tuple(sorted(d.values.items())), d.count) for d in self.demands)
        return strands, demands, self.count

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
        return self._program(range(len(self.demands)), self._independent(), ties)

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

    def nearest(self) -> tuple[int, ...] | None:
        """Return counts of the demands that can be met, changed by as few images as possible.

        None if the attributes' own counts do not go together, whatever is demanded.
        """
        import scipy.sparse as sp

        cells, demands = len(self.combinations), len(self.demands)
        rows, low, high = self._margins
        marks = sp.csr_matrix(np.array([self._marked(demand) for demand in self.demands], float))
        slack = sp.csr_matrix((rows.shape[0], 2 * demands))
        own = sp.hstack([marks, sp.eye(demands), -sp.eye(demands)])
        counts = np.array([demand.count for demand in self.demands], dtype=np.float64)
        costs = np.concatenate([np.zeros(cells), np.ones(2 * demands)])
        most = np.full_like(costs, np.inf)
        limits = [(sp.hstack([rows, slack]), low, high), (own, counts, counts)]
        found = _solved(costs, most, limits)
        return None if found is None else tuple((marks @ found[:cells]).astype(int).tolist())

    def _possible(self, numbers: Sequence[int]) -> bool:
        nothing = np.zeros(len(self.combinations))
        most = np.full_like(nothing, self.count)
        return _solved(nothing, most, self._exact(numbers)) is not None

    def _exact(self, numbers: Sequence[int]) -> list[tuple[Any, Any, Any]]:
        """Return the limits that the attributes' counts and demands set: rows, least and most."""
        import scipy.sparse as sp

        limits: list[tuple[Any, Any, Any]] = [self._margins]
        for number in numbers:
            demand = self.demands[number]
            limits.append((sp.csr_matrix(self._marked(demand)), demand.count, demand.count))
        return limits

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
    def _margins(self) -> tuple[Any, Floats, Floats]:
        """Return rows (values, cells), and the fewest and the most images of each value."""
        import scipy.sparse as sp

        rows, low, high = [np.ones(len(self.combinations))], [self.count], [self.count]
        for place, strand in enumerate(self.strands):
            share, extra = divmod(self.count, strand.size)
            for value in range(strand.size):
                rows.append((self.combinations[:, place] == value).astype(np.float64))
                given = None if strand.counts is None else int(strand.counts[value])
                low.append(share if given is None else given)
                high.append(share + bool(extra) if given is None else given)
        return sp.csr_matrix(np.array(rows)), np.array(low, float), np.array(high, float)

    def _marked(self, demand: Demand) -> Floats:
        """Return 1 for the combinations (cells,) that a demand is about, 0 for others."""
        marked = np.ones(len(self.combinations))
        for place, values in demand.values.items():
            marked *= np.isin(self.combinations[:, place], sorted(values))
        return marked

    def _independent(self) -> Floats:
        """Return shares of the images (cells,): independent, then fitted to demands and counts."""
        shares = [strand.shares for strand in self.strands]
        cells = np.full(len(self.combinations), float(self.count))
        for place, share in enumerate(shares):
            cells *= share[self.combinations[:, place]]
        marks = [(self._marked(demand) > 0, demand.count) for demand in self.demands]
        for _ in range(_FITTINGS):
            before = cells.copy()
            for marked, count in marks:
                cells[marked] *= _ratio(count, cells[marked].sum())
                cells[~marked] *= _ratio(self.count - count, cells[~marked].sum())
            for place, share in enumerate(shares):
                column = self.combinations[:, place]
                sums = np.bincount(column, weights=cells, minlength=len(share))
                ratios = np.divide(
                    self.count * share, sums, out=np.zeros_like(sums), where=sums > 0
                )
                cells *= ratios[column]
            if np.abs(cells - before).max() < 1e-6:
                break
        return cells


def _ratio(wanted: float, found: float) -> float:
    return wanted / found if found > 0 else 0.0


def _solved(costs: Floats, most: Floats, limits: Sequence[tuple[Any, Any, Any]]) -> Ints | None:
    """Return the whole numbers from 0 to `most` whose cost is least; None if there are none.

    Raises RuntimeError where the solver cannot tell.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    found = milp(
        costs,
        integrality=np.ones_like(costs),
        bounds=Bounds(0, most),
        constraints=[LinearConstraint(*limit) for limit in limits],
        options={"mip_rel_gap": 0.0},
    )
    if found.status not in (_FOUND, _NONE):
        raise RuntimeError(f"the solver gave no answer: {found.message}")
    return None if found.status == _NONE else np.rint(found.x).astype(np.int64)


def links(demands: Sequence[Demand]) -> list[tuple[tuple[int, ...], list[int]]]:
    """Return groups of places that demands link, in order, with the demands' numbers."""
    groups: list[tuple[set[int], list[int]]] = []
    for number, demand in enumerate(demands):
        places, numbers = set(demand.values), [number]
        for group in [group for group in groups if group[0] & places]:
            places |= group[0]
            numbers = group[1] + numbers
            groups.remove(group)
        groups.append((places, sorted(numbers)))
    return [(tuple(sorted(places)), numbers) for places, numbers in groups]


def relative(demand: Demand, places: Sequence[int]) -> Demand:
    """Return a demand with places counted among those of its group."""
    return Demand({places.index(k): values for k, values in demand.values.items()}, demand.count)
