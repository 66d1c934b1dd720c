"""How far two columns depend on each other: chi-square and Cramér's V.

V is 0 for independent columns and 1 where one settles the other. A table of many cells and few
images has a large V by chance alone; `corrected_v` takes that away (Bergsma 2013). The p-value is
how often images dealt at random, with the same counts of each value, depend on each other as much:
from the chi-square distribution where there are five images a cell or more, else by dealing.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.strict import StrictModel
from hi5_common.fairness.observed import I8

FEWEST_A_CELL = 5.0
DEALS, FEWEST_DEALS = 999, 100
MOST_DEALT = 50_000_000
"""Images times deals: beyond it fewer deals are made."""


class Association(StrictModel):
    """Two columns crossed. largest: the pair of values furthest from chance, in images."""

    a: str
    b: str
    images: int
    chi2: float
    degrees_of_freedom: int
    p: float
    p_by: Literal["chi2", "dealing"]
    cramers_v: float
    corrected_v: float
    largest: tuple[str, str]
    largest_images: int
    largest_expected: float


@dataclass(frozen=True, eq=False)
class Column:
    """A name, the number (n,) of each image's value (-1: unknown), and the values' names."""

    name: str
    codes: I8
    values: tuple[str, ...]


def association(a: Column, b: Column) -> Association | None:
    """Return how two columns depend on each other; None if one of them does not vary."""
    known = (a.codes >= 0) & (b.codes >= 0)
    rows, row_values = _dense(a.codes[known])
    columns, column_values = _dense(b.codes[known])
    if min(len(row_values), len(column_values)) < 2:
        return None
    table = _table(rows, columns, len(row_values), len(column_values))
    images = len(rows)
    expected = np.outer(table.sum(axis=1), table.sum(axis=0)) / images
    chi2 = float(((table - expected) ** 2 / expected).sum())
    freedom = (table.shape[0] - 1) * (table.shape[1] - 1)
    from scipy.special import chdtrc  # half a second that the service's start can do without

    sparse = images < FEWEST_A_CELL * table.size
    p = _dealt(rows, columns, expected, chi2) if sparse else float(chdtrc(freedom, chi2))
    residual = np.abs(table - expected) / np.sqrt(expected)
    x, y = np.unravel_index(int(residual.argmax()), table.shape)
    return Association(
        a=a.name,
        b=b.name,
        images=images,
        chi2=chi2,
        degrees_of_freedom=freedom,
        p=p,
        p_by="dealing" if sparse else "chi2",
        cramers_v=float(np.sqrt(chi2 / images / (min(table.shape) - 1))),
        corrected_v=_corrected(chi2, images, table.shape),
        largest=(a.values[row_values[x]], b.values[column_values[y]]),
        largest_images=int(table[x, y]),
        largest_expected=float(expected[x, y]),
    )


def _dense(codes: I8) -> tuple[I8, I8]:
    """Return codes renumbered without gaps, and what each number was."""
    values, numbers = np.unique(codes, return_inverse=True)
    return numbers.astype(np.int64), values


def _table(rows: I8, columns: I8, height: int, width: int) -> I8:
    counts = np.bincount(rows * width + columns, minlength=height * width)
    return counts.reshape(height, width)


def _dealt(rows: I8, columns: I8, expected: np.ndarray, chi2: float) -> float:
    """Return how often random deals have at least this chi-square.

    A gamma distribution with the mean and variance of dealt chi-squares says so: counting deals
    could never be surer than one over their number.
    """
    rng = factor_rng(0, len(rows), "fairness/deals")
    deals = int(np.clip(MOST_DEALT // max(len(rows), 1), FEWEST_DEALS, DEALS))
    height, width = expected.shape
    dealt = np.array(
        [
            (
                (_table(rows, rng.permutation(columns), height, width) - expected) ** 2 / expected
            ).sum()
            for _ in range(deals)
        ]
    )
    from scipy.special import gammaincc

    mean, variance = float(dealt.mean()), float(dealt.var())
    if variance <= 0.0:
        return 1.0  # every deal gives the same table
    return float(gammaincc(mean**2 / variance, chi2 * mean / variance))


def _corrected(chi2: float, images: int, shape: tuple[int, ...]) -> float:
    height, width = shape
    if images < 2:
        return 0.0
    phi2 = max(0.0, chi2 / images - (height - 1) * (width - 1) / (images - 1))
    rows = height - (height - 1) ** 2 / (images - 1)
    columns = width - (width - 1) ** 2 / (images - 1)
    smaller = min(rows, columns) - 1
    return float(np.sqrt(phi2 / smaller)) if smaller > 0 else 0.0
