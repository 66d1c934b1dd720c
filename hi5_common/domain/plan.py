"""The plan: which attribute values image i gets, computed from (spec, seed, i) and never stored.

The order of images comes from `planning/`: any number of images from the first on holds every
value's share within two images, all of them hold it exactly, and pairs come as evenly as was found.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from hi5_common.domain import splits
from hi5_common.domain.ordering import numbered, value_counts
from hi5_common.domain.planning.joined import Interleaved, Renumbered, Twinned
from hi5_common.domain.planning.order import Order
from hi5_common.domain.planning.sizes import joint_extremes, pair_sizes
from hi5_common.domain.planning.strand import Ints
from hi5_common.domain.records import Tallies
from hi5_common.domain.sharding import ShardRange, images_per_shard, shard_ranges
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.tallies import joined, pair_key, value_key
from hi5_common.domain.vocabulary import (
    DEFAULTS,
    Attribute,
    Gender,
    Handedness,
    NailPolish,
    Pose,
    Ring,
    Sleeve,
    Viewpoint,
    WristWear,
)

ALGORITHM = "woven-2"
CHUNK = 1 << 14


@dataclass(frozen=True)
class Cell:
    """The attribute values of one image, fields in planning order.

    skin_tone is a name or a number of degrees (`skin_tone_ita_deg` reads both), environment the id
    of a place, and the shape factors are bands (`parse_band`) that the scene draws from.
    """

    gender: Gender
    skin_tone: str
    pose: Pose
    environment: str
    handedness: Handedness
    viewpoint: Viewpoint
    age: str
    weight: str
    muscle: str
    finger_length: str
    finger_thickness: str
    hand_scale: str
    ring: Ring
    wrist_wear: WristWear
    nail_polish: NailPolish
    sleeve: Sleeve

    def as_dict(self) -> dict[Attribute, str]:
        """Return the values by attribute, in planning order."""
        return {attribute: str(getattr(self, attribute.value)) for attribute in Attribute}


class Cells(Protocol):
    """What gives images their attribute values: a plan, or scenes that were chosen."""

    def cell(self, index: int) -> Cell:
        """Return the cell of image `index`."""
        ...

    def split_of(self, index: int, /) -> str | None:
        """Return the split that image `index` belongs to, if there are any."""
        ...


def cell_of(values: Mapping[Attribute, str]) -> Cell:
    """Return the cell with these values; other attributes have the one that they have unasked."""
    every = {attribute: values.get(attribute, DEFAULTS[attribute][0]) for attribute in Attribute}
    fields: list[Any] = [_ENUMERATIONS.get(name, str)(value) for name, value in every.items()]
    return Cell(*fields)


@dataclass(frozen=True, eq=False)
class Level:
    """One attribute: the values asked for and how many images (n,) each gets."""

    values: tuple[str, ...]
    counts: Ints


@dataclass(frozen=True)
class PairRange:
    """How many images the pairs of two attributes have, and how far from independent they are.

    furthest: images by which a pair is off the product of its values' shares.
    """

    attributes: tuple[Attribute, Attribute]
    smallest: int
    largest: int
    furthest: float


@dataclass(frozen=True, eq=False)
class Plan:
    """Every image's cell, with exact counts. Memory does not grow with the number of images.

    order gives value numbers of the attributes in `crossed`; the others have one value.
    """

    spec: DatasetSpec
    levels: dict[Attribute, Level]
    crossed: tuple[Attribute, ...]
    order: Order

    @classmethod
    def of(cls, spec: DatasetSpec) -> Self:
        """Plan a spec. The same spec gives the same plan everywhere."""
        found = numbered(spec)
        levels = {
            name: Level(found.values[name], value_counts(found, name, spec.count))
            for name in Attribute
        }
        return cls(spec, levels, found.crossed, found.order)

    @property
    def count(self) -> int:
        return self.spec.count

    @property
    def images_per_shard(self) -> int:
        return images_per_shard(self.spec)

    def shards(self) -> tuple[ShardRange, ...]:
        """Cut the images into index ranges of about a minute or two of work each."""
        return tuple(shard_ranges(self.spec))

    def cell(self, index: int) -> Cell:
        """Return the cell of image `index` (0 <= index < count; IndexError otherwise)."""
        if not 0 <= index < self.count:
            raise IndexError(f"image {index} is not in 0..{self.count - 1}")
        return next(self.cells(index, index + 1))

    def cells(self, start: int = 0, stop: int | None = None) -> Iterator[Cell]:
        """Yield the cells of images start..stop-1 in index order."""
        stop = self.count if stop is None else min(stop, self.count)
        order = list(Attribute)
        fields: list[Any] = [self._words[attribute][0] for attribute in order]
        columns = [(order.index(name), self._words[name]) for name in self.crossed]
        for low in range(start, stop, CHUNK):
            indices = np.arange(low, min(low + CHUNK, stop), dtype=np.int64)
            for row in self.order.rows(indices).tolist():
                for (place, words), number in zip(columns, row, strict=True):
                    fields[place] = words[number]
                yield Cell(*fields)

    def split_of(self, index: int, /) -> str | None:
        """Return the split that image `index` belongs to; None if the dataset is not split."""
        if self.spec.splits is None:
            return None
        order = self.order.order if isinstance(self.order, Twinned) else self.order
        order = order.order if isinstance(order, Renumbered) else order
        if not isinstance(order, Interleaved):
            raise TypeError("the order of a dataset that is split is interleaved")
        scene = np.array([index // self.spec.images_per_scene], dtype=np.int64)
        return self.spec.splits.names[int(order.places(scene)[0][0])]

    def split_counts(self) -> dict[str, int]:
        """Return the number of images of each split; nothing if the dataset is not split."""
        return splits.image_counts(self.spec)

    def render_order(self, start: int, stop: int) -> tuple[int, ...]:
        """Return images start..stop-1 in the order that loads least: one place after another, in
        each the hands of one gender after the other's. No image depends on what came before it.
        """
        cells = zip(range(start, stop), self.cells(start, stop), strict=True)
        keyed = sorted((cell.environment, cell.gender.value, index) for index, cell in cells)
        return tuple(index for _, _, index in keyed)

    def value_counts(self, attribute: Attribute) -> dict[str, int]:
        """Return the exact number of images of each requested value, in canonical order."""
        level = self.levels[attribute]
        counts = dict(zip(level.values, level.counts.tolist(), strict=True))
        return {value: counts[value] for value in self.spec.values_of(attribute)}

    def pair_counts(self, a: Attribute, b: Attribute) -> dict[tuple[str, str], int]:
        """Return the exact number of images of each pair of requested values."""
        values_a, values_b = self.levels[a].values, self.levels[b].values
        sizes = self._pairs(a, b)
        rows = {value: number for number, value in enumerate(values_a)}
        columns = {value: number for number, value in enumerate(values_b)}
        pairs = itertools.product(self.spec.values_of(a), self.spec.values_of(b))
        return {(x, y): int(sizes[rows[x], columns[y]]) for x, y in pairs}

    def tallies_of_first(self, count: int) -> Tallies:
        """Return what the first images add up to, as far as values and pairs occur."""
        rows = self.order.rows(np.arange(count, dtype=np.int64)).astype(np.int64)
        fixed = [name for name in Attribute if name not in self.crossed]
        values = {value_key(name, self.levels[name].values[0]): count for name in fixed}
        keys = [[value_key(a, value) for value in self.levels[a].values] for a in self.crossed]
        for column, names in zip(rows.T, keys, strict=True):
            values |= _counted(names, np.bincount(column, minlength=len(names)))
        pairs = dict[str, int]()
        for a, b in itertools.combinations(range(len(self.crossed)), 2):
            names = list(itertools.starmap(joined, itertools.product(keys[a], keys[b])))
            codes = rows[:, a] * len(keys[b]) + rows[:, b]
            pairs |= _counted(names, np.bincount(codes, minlength=len(names)))
        return Tallies(values, pairs)

    def tallies(self) -> Tallies:
        """Return what all images add up to, as far as they occur: deliveries grow towards it."""
        values = {
            value_key(attribute, value): count
            for attribute in Attribute
            for value, count in self.value_counts(attribute).items()
            if count
        }
        pairs = {
            pair_key((a, x), (b, y)): count
            for a, b in itertools.combinations(self.crossed, 2)
            for (x, y), count in self.pair_counts(a, b).items()
            if count
        }
        return Tallies(values, pairs)

    def joint_extremes(self) -> tuple[int, int]:
        """Return the smallest and the largest count of a joint cell that the spec asks for."""
        return joint_extremes(self.order)

    def pair_ranges(self) -> tuple[PairRange, ...]:
        """Return what every two attributes with a choice come to; values of no images left out."""
        ranges = []
        for a, b in itertools.combinations(self.crossed, 2):
            of_a, of_b = self.levels[a].counts, self.levels[b].counts
            sizes = self._pairs(a, b)
            off = float(np.abs(sizes - np.outer(of_a, of_b) / self.count).max())
            asked = sizes[np.ix_(of_a > 0, of_b > 0)]
            ranges.append(PairRange((a, b), int(asked.min()), int(asked.max()), off))
        return tuple(ranges)

    def _pairs(self, a: Attribute, b: Attribute) -> Ints:
        """Return how many images each pair of value numbers has."""
        if a in self.crossed and b in self.crossed:
            return pair_sizes(self.order, self.crossed.index(a), self.crossed.index(b))
        return np.outer(self.levels[a].counts, self.levels[b].counts) // self.count

    @cached_property
    def _words(self) -> dict[Attribute, tuple[str, ...]]:
        """Return the values of every attribute, as members of their enumeration."""
        return {
            attribute: tuple(map(_ENUMERATIONS.get(attribute, str), level.values))
            for attribute, level in self.levels.items()
        }


def _counted(names: Sequence[str], counts: Ints) -> dict[str, int]:
    return {name: count for name, count in zip(names, counts.tolist(), strict=True) if count}


_ENUMERATIONS: dict[Attribute, type[StrEnum]] = {
    Attribute.GENDER: Gender,
    Attribute.POSE: Pose,
    Attribute.HANDEDNESS: Handedness,
    Attribute.VIEWPOINT: Viewpoint,
    Attribute.RING: Ring,
    Attribute.WRIST_WEAR: WristWear,
    Attribute.NAIL_POLISH: NailPolish,
    Attribute.SLEEVE: Sleeve,
}
