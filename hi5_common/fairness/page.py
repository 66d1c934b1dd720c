"""The audit as one HTML file that needs nothing else: no script, no font, no network."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from hi5_common.fairness.association import Association
from hi5_common.fairness.observed import MEANING
from hi5_common.fairness.report import Fairness
from hi5_common.fairness.spreads import MeasureSpread, Spread
from hi5_common.fairness.words import Verdict

TEMPLATES = Path(__file__).parent / "templates"
"""audit.html is the whole page, audit_body.html what any page may show of it."""
STYLES = Path(__file__).parent / "static"
"""audit.css is for the body on any page that has the colours of frame.css."""
MOST_ROWS = 20
"""Attributes of more values are drawn as their furthest values only, or not at all."""
SHADES = 10


def html(report: Fairness, title: str, command: str, integrity: tuple[str, ...] = ()) -> str:
    """Return the page. command: what audits this dataset's pictures as well.

    integrity: what the bytes' own audit found, a line each.
    """
    environment = Environment(
        loader=FileSystemLoader((TEMPLATES, STYLES)),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("audit.html").render(
        title=title, **body(report, command, integrity)
    )


def body(report: Fairness, command: str, integrity: tuple[str, ...] = ()) -> dict[str, object]:
    """Return what audit_body.html needs."""
    unfair = sum(one.verdict is Verdict.UNFAIR for one in report.statements)
    return {
        "report": report,
        "command": command,
        "integrity": integrity,
        "worst": "unfair" if unfair else "fair" if report.delivered else "note",
        "headline": _headline(report, unfair),
        "matrix": _matrix(report.attributes),
        "nuisance_matrix": _matrix(report.nuisances),
        "boxes": [_boxes(spread) for spread in report.measures],
        "meaning": MEANING,
        "most_rows": MOST_ROWS,
        "shade": _shade,
    }


def _headline(report: Fairness, unfair: int) -> str:
    if not report.delivered:
        return "Nothing is delivered yet."
    of_what = "the labels and pictures" if report.alike else "the labels"
    found = {0: "Nothing", 1: "One thing"}.get(unfair, f"{unfair} things")
    so_far = " delivered so far" if report.to_come else ""
    return f"{found} found to be unfair in {of_what}{so_far}."


def _shade(share: float) -> int:
    """Return a share in tenths: the depth of its colour."""
    return round(SHADES * min(max(share, 0.0), 1.0))


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
