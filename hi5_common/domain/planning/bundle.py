"""Strands that demands tie together: how many images each of their combinations has is given.

They are laid as one: at every image the combination comes next, of those that have images left,
whose values, whose own share, and whose pairs with what is laid already lag furthest behind.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hi5_common.domain.planning.strand import Floats, Ints

_OWN, _PAIRS = 0.5, 0.5
"""What the share of a combination, and a pair with what is laid, weigh against that of a value."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """Places of strands, their combinations (cells, places), and each one's images (cells,)."""

    places: tuple[int, ...]
    combinations: Ints
    counts: Ints

    def value_counts(self) -> list[Ints]:
        """Return the images of each value of every place, as far as values come."""
        return [
            np.bincount(column, weights=self.counts).astype(np.int64)
            for column in self.combinations.T
        ]

    def laid(self, contexts: Sequence[tuple[Ints, Floats]]) -> Ints:
        """Return the combinations (images, places) of all images.

        contexts: codes (images,) of what is laid, and how much codes have in common (n, n).
        """
        used = np.flatnonzero(self.counts)
        cells, left = self.combinations[used], self.counts[used].copy()
        count = int(left.sum())
        own, shares = np.zeros(len(used)), left / count
        values = [_Lags(column, shares) for column in cells.T]
        pairs = [
            (codes, _PairLags(column, shares, kin)) for codes, kin in contexts for column in cells.T
        ]
        order = np.empty(count, dtype=np.int64)
        for image in range(count):
            own += shares
            score = _OWN * own
            for lags in values:
                score += lags.grown()
            for codes, beside in pairs:
                score += _PAIRS * beside.at(int(codes[image]))
            score[left == 0] = -np.inf
            chosen = int(np.argmax(score))
            order[image] = chosen
            left[chosen] -= 1
            own[chosen] -= 1.0
            for lags in values:
                lags.take(chosen)
            for codes, beside in pairs:
                beside.take(int(codes[image]), chosen)
        return cells[order]


class _Lags:
    """How far each value of a strand is behind its share, at every combination."""

    def __init__(self, column: Ints, shares: Floats) -> None:
        self._column = column
        self._share = np.bincount(column, weights=shares)
        self._lag = np.zeros(len(self._share))

    def grown(self) -> Floats:
        """Count one more image, and return (cells,) a steep measure of the lags."""
        self._lag += self._share
        return np.asarray((self._lag + self._lag**3)[self._column], dtype=np.float64)

    def take(self, cell: int) -> None:
        """Give the image to a combination."""
        self._lag[self._column[cell]] -= 1.0


class _PairLags:
    """How far each value is behind its share of the images that have a code of a context."""

    def __init__(self, column: Ints, shares: Floats, kin: Floats) -> None:
        self._column, self._kin = column, kin
        self._share = np.bincount(column, weights=shares)
        self._met = np.zeros((len(kin), len(self._share)))
        self._seen = np.zeros(len(kin))

    def at(self, code: int) -> Floats:
        """Return (cells,) the lags at an image with a code, itself counted."""
        lag = (self._seen[code] + self._kin[code, code]) * self._share - self._met[code]
        return np.asarray(lag[self._column], dtype=np.float64)

    def take(self, code: int, cell: int) -> None:
        """Give the image to a combination."""
        self._seen += self._kin[code]
        self._met[:, self._column[cell]] += self._kin[code]
