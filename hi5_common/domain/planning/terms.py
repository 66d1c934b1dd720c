"""What a spec may ask of the combinations of linked attributes, as rows of an integer program.

Places are numbers of strands, values are numbers of a strand; `cells` (n, strands) are all the
combinations, and `images` (n,) how many images each of them has.
"""

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Protocol, Self

import numpy as np

from hi5_common.domain.planning.strand import Floats, Ints

CLOSEST = Fraction(1, 10_000)
"""How far under a whole image a count stays from its share at least, where shares are so fine that
solvers could not tell."""

Limits = tuple[Any, Floats, Floats]
"""Sparse rows (k, n), and the least and the most (k,) that they may come to."""


@dataclass(frozen=True, eq=False)
class Slack:
    """By how much rows may be broken, and what that costs: columns (k, m) beside theirs."""

    columns: Any
    costs: Floats
    whole: bool


class Term(Protocol):
    """One thing that is asked for."""

    @property
    def places(self) -> frozenset[int]:
        """Return the strands that it links."""
        ...

    @property
    def key(self) -> Hashable:
        """Return what two equal terms have in common."""
        ...

    def at(self, places: Sequence[int]) -> Self:
        """Return it with places counted among those of its group."""
        ...

    def marks(self, place: int, size: int) -> Ints:
        """Return numbers (size,) that differ where it tells two values of a strand apart."""
        ...

    def coarse(self, classes: Sequence[Ints], /) -> Self:
        """Return it with classes (n,), of values that it does not tell apart, as values."""
        ...

    def limits(self, cells: Ints) -> Limits:
        """Return the rows that hold exactly where it is met."""
        ...

    @property
    def slack(self) -> Slack:
        """Return how the rows may be broken, in images."""
        ...

    def fitting(self, cells: Ints, count: int, /) -> Callable[[Floats], None]:
        """Return what makes expected images (n,) fit it, in place and by proportion."""
        ...

    def nearest(self, cells: Ints, images: Ints) -> int | tuple[int, ...] | None:
        """Return what could have been asked for where images are these; None: just what was."""
        ...


@dataclass(frozen=True)
class Demand:
    """So many images shall have values that are all among those listed, by number of a strand."""

    values: Mapping[int, frozenset[int]]
    count: int

    @property
    def places(self) -> frozenset[int]:
        return frozenset(self.values)

    @property
    def key(self) -> Hashable:
        return tuple(sorted(self.values.items())), self.count

    def at(self, places: Sequence[int]) -> "Demand":
        return Demand({places.index(k): values for k, values in self.values.items()}, self.count)

    def marks(self, place: int, size: int) -> Ints:
        return _among(self.values, place, size)

    def coarse(self, classes: Sequence[Ints]) -> "Demand":
        return Demand(_coarse(self.values, classes), self.count)

    def limits(self, cells: Ints) -> Limits:
        count = np.array([self.count], dtype=np.float64)
        return _sparse(marked(cells, self.values)[None, :]), count, count

    @property
    def slack(self) -> Slack:
        return Slack(_sparse(np.array([[1.0, -1.0]])), np.ones(2), True)

    def fitting(self, cells: Ints, count: int) -> Callable[[Floats], None]:
        mine = marked(cells, self.values) > 0

        def fit(expected: Floats) -> None:
            expected[mine] *= _ratio(self.count, expected[mine].sum())
            expected[~mine] *= _ratio(count - self.count, expected[~mine].sum())

        return fit

    def nearest(self, cells: Ints, images: Ints) -> int:
        return int(images[marked(cells, self.values) > 0].sum())


@dataclass(frozen=True)
class Conditional:
    """Of the images whose values are among those given, each value of a strand shall have its
    share (n,), to less than an image: the whole number below or above it.
    """

    given: Mapping[int, frozenset[int]]
    of: int
    shares: tuple[Fraction, ...]

    @property
    def places(self) -> frozenset[int]:
        return frozenset(self.given) | {self.of}

    @property
    def key(self) -> Hashable:
        return tuple(sorted(self.given.items())), self.of, self.shares

    def at(self, places: Sequence[int]) -> "Conditional":
        given = {places.index(k): values for k, values in self.given.items()}
        return Conditional(given, places.index(self.of), self.shares)

    def overlaps(self, other: "Conditional") -> bool:
        """Tell whether both give shares of one strand to images that may be the same."""
        both = self.given.keys() & other.given.keys()
        return self.of == other.of and all(self.given[k] & other.given[k] for k in both)

    def marks(self, place: int, size: int) -> Ints:
        return np.arange(size) if place == self.of else _among(self.given, place, size)

    def coarse(self, classes: Sequence[Ints]) -> "Conditional":
        return Conditional(_coarse(self.given, classes), self.of, self.shares)

    def limits(self, cells: Ints) -> Limits:
        within = marked(cells, self.given)
        steps = math.lcm(*(share.denominator for share in self.shares))
        under = float(1 - max(Fraction(1, steps), CLOSEST))
        rows = np.array(
            [within * ((cells[:, self.of] == v) - float(s)) for v, s in enumerate(self.shares)]
        )
        most = np.array([under if share else 0.0 for share in self.shares])
        return _sparse(rows), -most, most

    @property
    def slack(self) -> Slack:
        # An image that has another value is one too many of one and too few of another.
        one = np.eye(len(self.shares))
        return Slack(_sparse(np.hstack([one, -one])), np.full(2 * len(one), 0.5), False)

    def fitting(self, cells: Ints, _count: int) -> Callable[[Floats], None]:
        within = marked(cells, self.given) > 0
        columns = [within & (cells[:, self.of] == value) for value in range(len(self.shares))]

        def fit(expected: Floats) -> None:
            images = expected[within].sum()
            for mine, share in zip(columns, self.shares, strict=True):
                expected[mine] *= _ratio(float(share) * images, expected[mine].sum())

        return fit

    def nearest(self, cells: Ints, images: Ints) -> tuple[int, ...] | None:
        mine = np.where(marked(cells, self.given) > 0, images, 0)
        counts = np.bincount(cells[:, self.of], weights=mine, minlength=len(self.shares))
        found = counts.astype(np.int64).tolist()
        whole = sum(found)
        met = all(abs(n - share * whole) < 1 for n, share in zip(found, self.shares, strict=True))
        return None if met else tuple(found)


@dataclass(frozen=True)
class AtLeast:
    """Every combination of the values of some strands, of sizes (n,), has so many images."""

    among: tuple[int, ...]
    sizes: tuple[int, ...]
    least: int

    @property
    def places(self) -> frozenset[int]:
        return frozenset(self.among)

    @property
    def key(self) -> Hashable:
        return self

    def at(self, places: Sequence[int]) -> "AtLeast":
        return AtLeast(tuple(places.index(k) for k in self.among), self.sizes, self.least)

    def marks(self, place: int, size: int) -> Ints:
        return np.arange(size) if place in self.among else np.zeros(size, dtype=np.int64)

    def coarse(self, _classes: Sequence[Ints]) -> "AtLeast":
        return self

    def limits(self, cells: Ints) -> Limits:
        import scipy.sparse as sp

        codes, size = self._codes(cells), math.prod(self.sizes)
        ones = np.ones(len(cells))
        rows = sp.csr_matrix((ones, (codes, np.arange(len(cells)))), shape=(size, len(cells)))
        return rows, np.full(size, float(self.least)), np.full(size, np.inf)

    @property
    def slack(self) -> Slack:
        size = math.prod(self.sizes)
        return Slack(_sparse(np.ones((size, 1))), np.array([float(size)]), True)

    def fitting(self, cells: Ints, _count: int) -> Callable[[Floats], None]:
        codes = self._codes(cells)

        def fit(expected: Floats) -> None:
            images = np.bincount(codes, weights=expected)
            short = (images > 0) & (images < self.least)
            images[short] /= self.least
            images[~short] = 1.0
            expected /= images[codes]

        return fit

    def nearest(self, cells: Ints, images: Ints) -> int | None:
        fewest = int(np.bincount(self._codes(cells), weights=images).min())
        return None if fewest >= self.least else fewest

    def _codes(self, cells: Ints) -> Ints:
        columns = tuple(cells[:, place] for place in self.among)
        return np.asarray(np.ravel_multi_index(columns, self.sizes), dtype=np.int64)


def marked(cells: Ints, values: Mapping[int, frozenset[int]]) -> Floats:
    """Return 1 for the combinations (n,) whose values are all among those listed, 0 for others."""
    found = np.ones(len(cells))
    for place, listed in values.items():
        found *= np.isin(cells[:, place], sorted(listed))
    return found


def _among(values: Mapping[int, frozenset[int]], place: int, size: int) -> Ints:
    listed = sorted(values.get(place, ()))
    return np.isin(np.arange(size), listed).astype(np.int64)


def _coarse(
    values: Mapping[int, frozenset[int]], classes: Sequence[Ints]
) -> dict[int, frozenset[int]]:
    return {
        place: frozenset(classes[place][sorted(listed)].tolist())
        for place, listed in values.items()
    }


def _ratio(wanted: float, found: float) -> float:
    return wanted / found if found > 0 else 0.0


def _sparse(rows: Floats) -> Any:
    import scipy.sparse as sp  # half a second, which most commands spare

    return sp.csr_matrix(rows)
