"""Counts of delivered labels: values and pairs against the plan, triples against chance."""

from itertools import combinations

import numpy as np

from hi5_common.domain.balance import Balance, balance_of
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Tallies
from hi5_common.domain.strict import StrictModel
from hi5_common.domain.tallies import pair_key, value_key
from hi5_common.domain.vocabulary import Attribute
from hi5_common.fairness.observed import I8, Observed

MOST_CELLS = 2_000_000
"""Cells of a triple that are counted (50 MB); one of more is left out and named."""


class Triple(StrictModel):
    """Three attributes crossed: cells, images of the smallest and largest, furthest from chance.

    furthest is in images, from the product of the three values' shares of what is delivered; None
    for a triple of too many cells.
    """

    attributes: tuple[Attribute, Attribute, Attribute]
    cells: int
    smallest: int | None
    largest: int | None
    furthest: float | None


def recounted(observed: Observed, plan: Plan) -> Balance:
    """Return the balance of what the labels say, whatever the rows' tallies are."""
    values = {
        value_key(name, value): int(count)
        for name in Attribute
        for value, count in zip(observed.values(name), _counts(observed, name), strict=True)
        if count
    }
    pairs = {
        pair_key((a, x), (b, y)): int(table[i, j])
        for a, b in combinations(plan.crossed, 2)
        for table in (_crossed(observed, (a, b)),)
        for i, x in enumerate(observed.values(a))
        for j, y in enumerate(observed.values(b))
        if table[i, j]
    }
    return balance_of(plan.spec, plan.tallies(), Tallies(values, pairs), len(observed))


def triples(observed: Observed, plan: Plan) -> tuple[Triple, ...]:
    """Return every three attributes with a choice."""
    return tuple(_triple(observed, names) for names in combinations(plan.crossed, 3))


def _triple(observed: Observed, names: tuple[Attribute, Attribute, Attribute]) -> Triple:
    cells = int(np.prod([len(observed.values(name)) for name in names]))
    if cells > MOST_CELLS or not len(observed):
        return Triple(attributes=names, cells=cells, smallest=None, largest=None, furthest=None)
    table = _crossed(observed, names)
    shares = [_counts(observed, name) / len(observed) for name in names]
    expected = len(observed) * np.einsum("i,j,k->ijk", *shares)
    return Triple(
        attributes=names,
        cells=cells,
        smallest=int(table.min()),
        largest=int(table.max()),
        furthest=float(np.abs(table - expected).max()),
    )


def _counts(observed: Observed, name: Attribute) -> I8:
    return _crossed(observed, (name,))


def _crossed(observed: Observed, names: tuple[Attribute, ...]) -> I8:
    """Return how many images each combination of value numbers has."""
    shape = tuple(len(observed.values(name)) for name in names)
    flat = np.ravel_multi_index([observed.codes(name) for name in names], shape)
    return np.bincount(flat, minlength=int(np.prod(shape))).reshape(shape)
