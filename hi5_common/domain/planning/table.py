"""The images of every combination of some strands' values: the whole numbers that meet limits.

Found by HiGHS, as small mixed-integer programs.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hi5_common.domain.planning.strand import Floats, Ints
from hi5_common.domain.planning.terms import Limits, Term

_SCALE = 1e3
"""Of costs: the solver takes answers that are less than a millionth apart for equally good."""
_FOUND, _NONE = 0, 2
"""What SciPy's `milp` says where it has the best answer, and where there is none."""

Bounds = tuple[Ints, Ints]
"""The fewest and the most images (n,) of each value of a strand."""


@dataclass(frozen=True, eq=False)
class Table:
    """Strands of some sizes, what they are bound to (None: to nothing), terms, images in all."""

    sizes: tuple[int, ...]
    bounds: tuple[Bounds | None, ...]
    terms: tuple[Term, ...]
    count: int

    @cached_property
    def cells(self) -> Ints:
        """Return every combination (cells, strands) of value numbers."""
        return np.array(list(itertools.product(*map(range, self.sizes))), dtype=np.int64)

    def possible(self, numbers: Sequence[int]) -> bool:
        """Tell whether some of the terms can be met together."""
        nothing = np.zeros(len(self.cells))
        most = np.full_like(nothing, self.count)
        return _solved(nothing, most, self.limits(numbers)) is not None

    def limits(self, numbers: Sequence[int]) -> list[Limits]:
        """Return the limits that strands and some of the terms set: rows, least and most."""
        return [self.margins, *(self._limits[number] for number in numbers)]

    @cached_property
    def _limits(self) -> list[Limits]:
        return [term.limits(self.cells) for term in self.terms]

    @cached_property
    def margins(self) -> Limits:
        """Return rows (values, cells), and the fewest and the most images of each value."""
        import scipy.sparse as sp

        rows, low, high = [np.ones(len(self.cells))], [self.count], [self.count]
        for place, bounds in enumerate(self.bounds):
            for value, (least, most) in enumerate(zip(*bounds, strict=True) if bounds else ()):
                rows.append((self.cells[:, place] == value).astype(np.float64))
                low.append(int(least))
                high.append(int(most))
        return sp.csr_matrix(np.array(rows)), np.array(low, float), np.array(high, float)

    def nearest(self) -> tuple[int | tuple[int, ...] | None, ...] | None:
        """Return what of the terms can be met, changed by as few images as possible.

        None if the strands' own counts do not go together, whatever is asked for.
        """
        import scipy.sparse as sp

        cells = len(self.cells)
        slacks = [term.slack for term in self.terms]
        rows, low, high = zip(*self.limits(range(len(slacks))), strict=True)
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
        return tuple(term.nearest(self.cells, found[:cells]) for term in self.terms)

    def near(self, wanted: Floats, ties: Floats, limits: Sequence[Limits]) -> Ints | None:
        """Return whole numbers (cells,) near `wanted`: the sum of distances, with `ties`, is least.

        Each is the whole part of what is wanted, less some images, with the one that rounds it up,
        and more: whole numbers alone, of which the solver's answer is exact.
        """
        import scipy.sparse as sp

        whole = np.floor(wanted)
        moved = [
            (sp.hstack([-rows, rows, rows]), low - rows @ whole, high - rows @ whole)
            for rows, low, high in limits
        ]
        up_costs = 1.0 - 2.0 * (wanted - whole)
        costs = _SCALE * np.concatenate([1.0 - ties, up_costs + ties, 1.0 + ties])
        most = np.concatenate([whole, np.ones_like(whole), np.full_like(whole, self.count)])
        found = _solved(costs, most, moved)
        if found is None:
            return None
        less, up, more = np.split(found, 3)
        return whole.astype(np.int64) - less + up + more


def _solved(
    costs: Floats, most: Floats, limits: Sequence[Limits], whole: Floats | None = None
) -> Ints | None:
    """Return the whole numbers from 0 to `most` whose cost is least; None if there are none.

    Where `whole` is 0 they need not be whole, and are rounded. Raises RuntimeError where the solver
    cannot tell.
    """
    from scipy.optimize import Bounds as Between
    from scipy.optimize import LinearConstraint, milp

    found = milp(
        costs,
        integrality=np.ones_like(costs) if whole is None else whole,
        bounds=Between(0, most),
        constraints=[LinearConstraint(*limit) for limit in limits],
        options={"mip_rel_gap": 0.0},
    )
    if found.status not in (_FOUND, _NONE):
        raise RuntimeError(f"the solver gave no answer: {found.message}")
    return None if found.status == _NONE else np.rint(found.x).astype(np.int64)
