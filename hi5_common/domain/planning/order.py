"""The order of a plan's images: woven as far as that is kept, and arithmetic from there on.

Up to WOVEN images are woven (weave.py, mend.py) and kept as a table of value numbers. Where there
are more, and every share is equal, whole periods of all combinations follow; else a woven table is
repeated, with another one spread among its repeats for what does not divide. Memory stays flat.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hi5_common.domain.planning.bundle import Bundle
from hi5_common.domain.planning.mend import mended
from hi5_common.domain.planning.strand import Ints, Strand, Table
from hi5_common.domain.planning.weave import weave

WOVEN = 1 << 20
"""Images that are woven, at most; where there are more, at least half as many."""


@dataclass(frozen=True, eq=False)
class Box:
    """Every combination of some value numbers (n,) of each strand, `times` times each."""

    values: tuple[Ints, ...]
    times: int


class Order(Protocol):
    """Value numbers of every image: of tables, and of boxes, of which no two overlap."""

    @property
    def sizes(self) -> tuple[int, ...]:
        """Return the number of values of each strand."""
        ...

    @property
    def tables(self) -> tuple[tuple[Table, int], ...]:
        """Return tables (images, strands) and how often each of their images comes."""
        ...

    @property
    def boxes(self) -> tuple[Box, ...]:
        """Return the combinations of values that come beside the tables."""
        ...

    @property
    def stray(self) -> float:
        """Return by how many images a running count of a value may be off its share."""
        ...

    def rows(self, indices: Ints) -> Table:
        """Return the value numbers (K, strands) of images (K,)."""
        ...


def order_of(
    strands: Sequence[Strand],
    count: int,
    rng: np.random.Generator,
    bundles: Sequence[Bundle] = (),
) -> Order:
    """Return the order of `count` images."""
    sizes = tuple(strand.size for strand in strands)
    if count <= WOVEN:
        return Periodic(_woven(strands, count, rng, bundles), sizes, 0)
    period = math.prod(sizes)
    equal = not bundles and all(strand.counts is None for strand in strands)
    if equal and period <= WOVEN // 2:
        periods = (count - WOVEN // 2) // period
        return Periodic(_woven(strands, count - periods * period, rng, ()), sizes, periods)
    return _repeated(strands, count, rng, bundles)


def grown(earlier: Table, strands: Sequence[Strand], rng: np.random.Generator) -> Order:
    """Return an order that begins with `earlier` (images, strands) and goes on with the strands.

    strands: what comes after, with counts. Pairs are woven and mended as even over all images as
    they would be without a beginning that is given.
    """
    sizes = tuple(strand.size for strand in strands)
    later = weave(strands, int(_counts(strands[0], 0).sum()), rng, (), earlier)
    table = mended(np.concatenate([earlier, later]), sizes, kept=len(earlier))
    table.flags.writeable = False
    return Periodic(table, sizes, 0)


def _woven(
    strands: Sequence[Strand], count: int, rng: np.random.Generator, bundles: Sequence[Bundle]
) -> Table:
    if not count:
        return np.zeros((0, len(strands)), dtype=np.uint16)
    sizes, tied = [strand.size for strand in strands], [bundle.places for bundle in bundles]
    table = mended(weave(strands, count, rng, bundles), sizes, tied)
    table.flags.writeable = False
    return table


@dataclass(frozen=True, eq=False)
class Periodic:
    """A table, then whole periods of all combinations: value k of image i turns with i, and takes
    a step whenever the combinations before it have come round with it.

    In a period every combination comes once, and every n_k images each value of attribute k.
    """

    head: Table
    sizes: tuple[int, ...]
    periods: int
    stray: float = 2.0

    @property
    def tables(self) -> tuple[tuple[Table, int], ...]:
        return ((self.head, 1),)

    @property
    def boxes(self) -> tuple[Box, ...]:
        whole = tuple(np.arange(size) for size in self.sizes)
        return (Box(whole, self.periods),) if self.periods else ()

    def rows(self, indices: Ints) -> Table:
        start = len(self.head)
        rows = np.empty((len(indices), len(self.sizes)), dtype=np.uint16)
        woven = indices < start
        rows[woven] = self.head[indices[woven]]
        later, combinations = indices[~woven] - start, 1
        for k, size in enumerate(self.sizes):
            together = math.lcm(combinations, size)
            combinations *= size
            steps = later // together % (combinations // together)
            rows[~woven, k] = (later + steps) % size
        return rows


@dataclass(frozen=True, eq=False)
class Repeated:
    """A table that is repeated, with the images of another spread evenly among its repeats."""

    base: Table
    repeats: int
    extra: Table
    sizes: tuple[int, ...]
    boxes: tuple[Box, ...] = ()
    stray: float = 4.0

    @property
    def tables(self) -> tuple[tuple[Table, int], ...]:
        return ((self.base, self.repeats), (self.extra, 1))

    def rows(self, indices: Ints) -> Table:
        extras = len(self.extra)
        count = len(self.base) * self.repeats + extras
        before, after = indices * extras // count, (indices + 1) * extras // count
        is_extra = after > before
        rows: Table = self.base[(indices - before) % len(self.base)]
        rows[is_extra] = self.extra[before[is_extra]]
        return rows


def _repeated(
    strands: Sequence[Strand], count: int, rng: np.random.Generator, bundles: Sequence[Bundle]
) -> Repeated:
    """Divide every value's images by the repeats; what is left over is woven by itself."""
    tied = [place for bundle in bundles for place in bundle.places]
    free = [place for place in range(len(strands)) if place not in tied]
    wanted = [bundle.counts for bundle in bundles]
    wanted += [_counts(strands[place], count) for place in free]
    repeats = -(-count // (WOVEN // 2))
    parts = [counts // repeats for counts in wanted]
    images = min(int(part.sum()) for part in parts)
    for part in parts:
        _shorten(part, images)
    rest = [counts - repeats * part for counts, part in zip(wanted, parts, strict=True)]
    tables = []
    for shares in (parts, rest):
        of_bundles = [
            Bundle(bundle.places, bundle.combinations, counts)
            for bundle, counts in zip(bundles, shares, strict=False)
        ]
        own = dict(zip(free, shares[len(bundles) :], strict=True))
        for bundle in of_bundles:
            own |= zip(bundle.places, bundle.value_counts(), strict=True)
        each = [Strand(len(own[place]), own[place]) for place in range(len(strands))]
        tables.append(_woven(each, int(shares[0].sum()), rng, of_bundles))
    return Repeated(tables[0], repeats, tables[1], tuple(strand.size for strand in strands))


def _shorten(counts: Ints, images: int) -> None:
    """Take images from the largest counts until they add up."""
    while (over := int(counts.sum()) - images) > 0:
        most = np.argsort(-counts, kind="stable")[:over]
        counts[most[counts[most] > 0]] -= 1


def _counts(strand: Strand, count: int) -> Ints:
    if strand.counts is not None:
        return strand.counts
    share, extra = divmod(count, strand.size)
    return share + (np.arange(strand.size) < extra).astype(np.int64)
