"""One attribute's part of a plan: how many images each of its values gets, and in what order."""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Table = npt.NDArray[np.uint16]
"""Value numbers (images, strands): no attribute has 65,536 values."""


@dataclass(frozen=True, eq=False)
class Strand:
    """The request for one attribute: counts (n,) of its values, or equal shares of n values.

    Of equal shares the last images go to whichever values they suit: no count is given.
    """

    size: int
    counts: Ints | None = None

    @property
    def equal(self) -> bool:
        """Whether every value has the same share."""
        return self.counts is None or int(np.ptp(self.counts)) == 0

    @cached_property
    def shares(self) -> Floats:
        """Return the values' shares (n,), which add up to 1."""
        if self.counts is None:
            return np.full(self.size, 1.0 / self.size)
        return self.counts / self.counts.sum()

    @property
    def frame(self) -> int:
        """Return how many images in a row may take their values in any order among themselves.

        In a frame of n images each of n equal values comes once; of F images with a value of share
        p, all in the worst order, F p (1 - p) is how far its running count is off: one image.
        """
        if self.equal:
            return self.size
        return int(1.0 / (self.shares * (1.0 - self.shares)).max(initial=1e-3))

    def values(self, count: int) -> Ints:
        """Return value numbers (count,) of images in a row, all values as evenly as they go.

        Of equal shares: 0, 1, ..., n-1, 0, ... Else every image of a value has the places at which
        the value's running count stays less than one off its share, and of those that may come now
        the one comes that must come first. There is always one that may (Tijdeman, 1980).
        """
        if self.equal:
            return np.arange(count, dtype=np.int64) % self.size
        if self.counts is None or int(self.counts.sum()) != count:
            raise ValueError("unequal counts are for as many images as they add up to")
        return np.array(_in_time(self.counts.tolist()), dtype=np.int64)


def _in_time(counts: Sequence[int]) -> list[int]:
    """Return a value for every place: the earliest deadline first, of those that may come."""
    total = sum(counts)
    may: dict[int, list[int]] = {}
    for value, count in enumerate(counts):
        if count:
            may.setdefault(0, []).append(value)
    came, waiting, order = [0] * len(counts), list[tuple[int, int]](), list[int]()
    for place in range(total):
        for value in may.pop(place, ()):
            # It must have come before its share of the images is a whole one more.
            last = -(-(came[value] + 1) * total // counts[value])
            heapq.heappush(waiting, (last, value))
        _, value = heapq.heappop(waiting)
        order.append(value)
        came[value] += 1
        if came[value] < counts[value]:
            next_place = max(place + 1, came[value] * total // counts[value])
            may.setdefault(next_place, []).append(value)
    return order
