"""The audit as one HTML file that needs nothing else: no script, no font, no network."""

from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from hi5_common.fairness.association import Association
from hi5_common.fairness.observed import MEANING
from hi5_common.fairness.report import Fairness
from hi5_common.fairness.spreads import MeasureSpread, Spread

MOST_ROWS = 20
"""Attributes of more values are drawn as their furthest values only, or not at all."""
WHITE_ON = 0.55
"""Heat from which letters on it are white."""


def html(report: Fairness, title: str, integrity: tuple[str, ...] = ()) -> str:
    """Return the page. integrity: what the bytes' own audit found, a line each."""
    environment = Environment(
        loader=PackageLoader("hi5_common.fairness", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("audit.html").render(
        report=report,
        title=title,
        integrity=integrity,
        matrix=_matrix(report.attributes),
        nuisance_matrix=_matrix(report.nuisances),
        boxes=[_boxes(spread) for spread in report.measures],
        meaning=MEANING,
        most_rows=MOST_ROWS,
        white_on=WHITE_ON,
    )


@dataclass(frozen=True)
class Matrix:
    """Associations as a table: cells by (row, column); None where there is none."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    cells: dict[tuple[str, str], Association]


@dataclass(frozen=True)
class BoxRow:
    """One box of a box plot, in percent of the plot's width."""

    label: str
    images: int
    percentiles: tuple[float, ...]
    left: tuple[float, ...]


@dataclass(frozen=True)
class Boxes:
    """A measure's histogram (heights in percent of the highest) and its box plots."""

    spread: MeasureSpread
    bars: tuple[float, ...]
    groups: dict[str, tuple[BoxRow, ...]]


def _matrix(found: tuple[Association, ...]) -> Matrix:
    names = [one.a for one in found], [one.b for one in found]
    return Matrix(
        rows=tuple(dict.fromkeys(names[0])),
        columns=tuple(dict.fromkeys(names[1])),
        cells={(one.a, one.b): one for one in found},
    )


def _boxes(spread: MeasureSpread) -> Boxes:
    highest = max(spread.histogram)
    low, high = spread.edges[0], spread.edges[-1]
    groups: dict[str, Any] = {"all": (spread.overall,)}
    groups |= {
        name.value: rows for name, rows in spread.by_attribute.items() if len(rows) <= MOST_ROWS
    }
    return Boxes(
        spread=spread,
        bars=tuple(100.0 * count / highest for count in spread.histogram),
        groups={name: tuple(_box(row, low, high) for row in rows) for name, rows in groups.items()},
    )


def _box(row: Spread, low: float, high: float) -> BoxRow:
    width = (high - low) or 1.0
    left = tuple(round(100.0 * (number - low) / width, 2) for number in row.percentiles)
    return BoxRow(row.value, row.images, row.percentiles, left)
