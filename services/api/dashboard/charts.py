"""Bars and heat tables as numbers a template can draw: widths in percent, heat in ten steps."""

from collections.abc import Mapping
from dataclasses import dataclass

from hi5_common.domain.balance import Balance, BalanceTable, CellBalance
from hi5_common.domain.vocabulary import Attribute

HEAT_STEPS = 10


@dataclass(frozen=True)
class Bar:
    """One value of an attribute. Widths and the mark are percent of the widest bar."""

    value: str
    requested: float
    planned: int
    delivered: int
    planned_width: float
    delivered_width: float
    requested_mark: float


@dataclass(frozen=True)
class BarChart:
    """The bars of one attribute."""

    attribute: Attribute
    bars: tuple[Bar, ...]
    worst_planned_deviation: float
    worst_delivered_deviation: float


@dataclass(frozen=True)
class HeatCell:
    """One pair of values. `step` is how much of the plan is delivered, 0 to HEAT_STEPS."""

    requested: float
    planned: int
    delivered: int
    step: int


@dataclass(frozen=True)
class HeatRow:
    """The cells of one value against every value of the other attribute."""

    value: str
    cells: tuple[HeatCell, ...]


@dataclass(frozen=True)
class HeatTable:
    """Two attributes crossed; the one with more values makes the rows."""

    row_attribute: Attribute
    column_attribute: Attribute
    columns: tuple[str, ...]
    rows: tuple[HeatRow, ...]
    worst_planned_deviation: float
    worst_delivered_deviation: float


def bar_chart(table: BalanceTable) -> BarChart:
    """Lay out one attribute's balance."""
    widest = max(max(cell.planned, cell.delivered, cell.requested) for cell in table.cells) or 1
    return BarChart(
        attribute=table.attributes[0],
        bars=tuple(_bar(cell, widest) for cell in table.cells),
        worst_planned_deviation=table.worst_planned_deviation,
        worst_delivered_deviation=table.worst_delivered_deviation,
    )


def crossed(balance: Balance) -> list[Attribute]:
    """Return the attributes that a dataset chooses between, in planning order."""
    among = {attribute for table in balance.pairs for attribute in table.attributes}
    return [attribute for attribute in Attribute if attribute in among]


def fixed(balance: Balance) -> dict[Attribute, str]:
    """Return the one value of every attribute that a dataset does not choose between."""
    among = crossed(balance)
    tables = [table for table in balance.attributes if table.attributes[0] not in among]
    return {table.attributes[0]: table.cells[0].values[0] for table in tables}


def heat_table(balance: Balance, a: Attribute, b: Attribute) -> HeatTable | None:
    """Lay out one pair of attributes (in any order); None if they are not crossed."""
    table = next((table for table in balance.pairs if set(table.attributes) == {a, b}), None)
    if table is None:
        return None
    first, second = table.attributes
    cells = {cell.values: cell for cell in table.cells}
    xs = tuple(dict.fromkeys(values[0] for values in cells))
    ys = tuple(dict.fromkeys(values[1] for values in cells))
    if len(xs) >= len(ys):
        rows, columns, row_values, column_values = first, second, xs, ys
    else:
        rows, columns, row_values, column_values = second, first, ys, xs
        cells = {(y, x): cell for (x, y), cell in _pairs(cells).items()}
    return HeatTable(
        row_attribute=rows,
        column_attribute=columns,
        columns=column_values,
        rows=tuple(
            HeatRow(row, tuple(_heat_cell(cells[row, column]) for column in column_values))
            for row in row_values
        ),
        worst_planned_deviation=table.worst_planned_deviation,
        worst_delivered_deviation=table.worst_delivered_deviation,
    )


def _pairs(cells: Mapping[tuple[str, ...], CellBalance]) -> dict[tuple[str, str], CellBalance]:
    return {(values[0], values[1]): cell for values, cell in cells.items()}


def _bar(cell: CellBalance, widest: float) -> Bar:
    return Bar(
        value=cell.values[0],
        requested=cell.requested,
        planned=cell.planned,
        delivered=cell.delivered,
        planned_width=round(100 * cell.planned / widest, 2),
        delivered_width=round(100 * cell.delivered / widest, 2),
        requested_mark=round(100 * cell.requested / widest, 2),
    )


def _heat_cell(cell: CellBalance) -> HeatCell:
    share = cell.delivered / cell.planned if cell.planned else 0.0
    step = min(HEAT_STEPS, int(share * HEAT_STEPS))
    return HeatCell(cell.requested, cell.planned, cell.delivered, step)
