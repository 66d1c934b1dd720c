"""How balanced a dataset is: what was requested, what the plan gives, what has been delivered.

Requested shares may be fractions of an image (583,000 over 44 poses); the plan is whole numbers
that add up; what is delivered grows towards the plan. Of attributes that a spec's combinations
link, the plan's pairs are what is requested. Two deviations say how far apart they are, in images:
planned from requested, and delivered from the plan's share of what is delivered so far.
"""

from collections.abc import Mapping
from itertools import combinations, product

from hi5_common.domain.demands import are_tied, expected_counts, follows
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Tallies
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.strict import StrictModel
from hi5_common.domain.tallies import pair_key, value_key
from hi5_common.domain.vocabulary import Attribute


class CellBalance(StrictModel):
    """Images of one value, or of one pair of values (one string an attribute)."""

    values: tuple[str, ...]
    requested: float
    planned: int
    delivered: int


class BalanceTable(StrictModel):
    """One attribute, or two crossed: a cell for each value or pair of values asked for."""

    attributes: tuple[Attribute, ...]
    cells: tuple[CellBalance, ...]
    worst_planned_deviation: float
    worst_delivered_deviation: float


class Balance(StrictModel):
    """The balance of a dataset of `count` images of which `delivered` are published."""

    count: int
    delivered: int
    attributes: tuple[BalanceTable, ...]
    pairs: tuple[BalanceTable, ...]
    worst_planned_deviation: float
    worst_delivered_deviation: float


def requested_counts(spec: DatasetSpec, attribute: Attribute) -> dict[str, float]:
    """Return how many images of each value the spec asks for, in canonical order."""
    counts = spec.counts_of(attribute)
    if counts is not None:
        return {value: float(count) for value, count in counts.items()}
    if follows(spec, attribute):
        return expected_counts(spec, attribute)
    asked = spec.values_of(attribute)
    return dict.fromkeys(asked, spec.count / len(asked))


def balance_of(plan: Plan, delivered: Tallies, delivered_images: int) -> Balance:
    """Set the plan and the tallies of `delivered_images` published images side by side.

    Pairs are of the attributes that the plan crosses: the others have one value.
    """
    share = delivered_images / plan.count
    singles = tuple(_value_table(plan, attribute, delivered, share) for attribute in Attribute)
    crossed = tuple(
        _pair_table(plan, a, b, delivered, share) for a, b in combinations(plan.crossed, 2)
    )
    tables = singles + crossed
    return Balance(
        count=plan.count,
        delivered=delivered_images,
        attributes=singles,
        pairs=crossed,
        worst_planned_deviation=max(table.worst_planned_deviation for table in tables),
        worst_delivered_deviation=max(table.worst_delivered_deviation for table in tables),
    )


def _value_table(plan: Plan, attribute: Attribute, tallies: Tallies, share: float) -> BalanceTable:
    requested = requested_counts(plan.spec, attribute)
    planned = plan.value_counts(attribute)
    cells = [
        CellBalance(
            values=(value,),
            requested=asked,
            planned=planned[value],
            delivered=tallies.values.get(value_key(attribute, value), 0),
        )
        for value, asked in requested.items()
    ]
    return _table((attribute,), cells, share)


def _pair_table(
    plan: Plan, a: Attribute, b: Attribute, tallies: Tallies, share: float
) -> BalanceTable:
    planned: Mapping[tuple[str, str], int] = plan.pair_counts(a, b)
    asked_a, asked_b = requested_counts(plan.spec, a), requested_counts(plan.spec, b)
    tied = are_tied(plan.spec, a, b)
    cells = [
        CellBalance(
            values=(x, y),
            requested=planned[x, y] if tied else asked_a[x] * asked_b[y] / plan.count,
            planned=planned.get((x, y), 0),
            delivered=tallies.pairs.get(pair_key((a, x), (b, y)), 0),
        )
        for x, y in product(asked_a, asked_b)
    ]
    return _table((a, b), cells, share)


def _table(
    attributes: tuple[Attribute, ...], cells: list[CellBalance], share: float
) -> BalanceTable:
    return BalanceTable(
        attributes=attributes,
        cells=tuple(cells),
        worst_planned_deviation=max(abs(cell.planned - cell.requested) for cell in cells),
        worst_delivered_deviation=max(abs(cell.delivered - cell.planned * share) for cell in cells),
    )
