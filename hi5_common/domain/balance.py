"""How balanced a dataset is: what was requested, what the plan gives, what has been delivered.

Requested shares may be fractions of an image (583,000 over 44 poses); the plan is whole numbers
that add up; what is delivered grows towards the plan. Of attributes that a spec's combinations
link, the plan's pairs are what is requested. Two deviations say how far apart they are, in images:
planned from requested, and delivered from the plan's share of what is delivered so far.
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

from hi5_common.domain import splits, twins
from hi5_common.domain.demands import are_tied, expected_counts, follows
from hi5_common.domain.records import Tallies
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.strict import StrictModel
from hi5_common.domain.tallies import joined, value_key
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
    if spec.splits and spec.splits.counts and attribute is spec.splits.attribute:
        return _of_each_split(spec, spec.splits.counts)
    asked = spec.values_of(attribute)
    return dict.fromkeys(asked, spec.count / len(asked))


def _of_each_split(spec: DatasetSpec, sizes: Mapping[str, int]) -> dict[str, float]:
    """Return equal shares of each split's images among the values that it has."""
    own = splits.dealt(twins.scenes_of(spec))
    split = {value: name for name, values in own.items() for value in values}
    among = spec.values_of(Attribute(spec.splits.by.value)) if spec.splits else ()
    return {value: sizes[split[value]] / len(own[split[value]]) for value in among}


def balance_of(
    spec: DatasetSpec, planned: Tallies, delivered: Tallies, delivered_images: int
) -> Balance:
    """Set the tallies of the plan and of `delivered_images` published images side by side.

    Pairs are of the attributes that the plan crosses: the others have one value.
    """
    requested = {attribute: requested_counts(spec, attribute) for attribute in Attribute}
    sides = _Sides(
        spec,
        requested,
        {name: [value_key(name, value) for value in asked] for name, asked in requested.items()},
        planned,
        delivered,
        delivered_images / spec.count,
    )
    singles = tuple(sides.of_value(attribute) for attribute in Attribute)
    crossed = tuple(sides.of_pair(a, b) for a, b in itertools.combinations(spec.balanced(), 2))
    tables = singles + crossed
    return Balance(
        count=spec.count,
        delivered=delivered_images,
        attributes=singles,
        pairs=crossed,
        worst_planned_deviation=max(table.worst_planned_deviation for table in tables),
        worst_delivered_deviation=max(table.worst_delivered_deviation for table in tables),
    )


@dataclass(frozen=True)
class _Sides:
    """What stands side by side: images by value, or by a key of tallies, of which keys has each
    value's; share: of the dataset that is delivered, 0..1.
    """

    spec: DatasetSpec
    requested: dict[Attribute, dict[str, float]]
    keys: dict[Attribute, list[str]]
    planned: Tallies
    delivered: Tallies
    share: float

    def of_value(self, attribute: Attribute) -> BalanceTable:
        cells = []
        requested = self.requested[attribute].items()
        for (value, asked), key in zip(requested, self.keys[attribute], strict=True):
            planned = self.planned.values.get(key, 0)
            delivered = self.delivered.values.get(key, 0)
            cells.append(
                CellBalance(values=(value,), requested=asked, planned=planned, delivered=delivered)
            )
        return _table((attribute,), cells, self.share)

    def of_pair(self, a: Attribute, b: Attribute) -> BalanceTable:
        tied = are_tied(self.spec, a, b)
        asked_a, asked_b = self.requested[a], self.requested[b]
        cells = []
        keys = itertools.starmap(joined, itertools.product(self.keys[a], self.keys[b]))
        for (x, y), key in zip(itertools.product(asked_a, asked_b), keys, strict=True):
            planned = self.planned.pairs.get(key, 0)
            delivered = self.delivered.pairs.get(key, 0)
            asked = planned if tied else asked_a[x] * asked_b[y] / self.spec.count
            cells.append(
                CellBalance(values=(x, y), requested=asked, planned=planned, delivered=delivered)
            )
        return _table((a, b), cells, self.share)


def _table(
    attributes: tuple[Attribute, ...], cells: list[CellBalance], share: float
) -> BalanceTable:
    return BalanceTable(
        attributes=attributes,
        cells=tuple(cells),
        worst_planned_deviation=max(abs(cell.planned - cell.requested) for cell in cells),
        worst_delivered_deviation=max(abs(cell.delivered - cell.planned * share) for cell in cells),
    )
