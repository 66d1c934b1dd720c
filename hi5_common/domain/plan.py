"""The plan: which attribute values image i gets, computed from (spec, seed, i) and never stored.

The joint cells and their sizes come from `apportion.py` and `evening.py`: at most one number per
joint cell that the spec can make, however many images there are. Image indices visit the cells'
positions in golden-ratio steps, so that any run of images is a fair sample of the whole.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from hi5_common.domain.apportion import Ints, joint_cells
from hi5_common.domain.evening import even_pairs
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.sharding import ShardRange, images_per_shard, shard_ranges
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.vocabulary import (
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

ALGORITHM = "tree-2"
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


@dataclass(frozen=True, eq=False)
class Level:
    """One attribute: the values asked for and how many images (n,) each gets."""

    values: tuple[str, ...]
    counts: Ints


@dataclass(frozen=True, eq=False)
class Plan:
    """Every image's cell, with exact counts. Memory does not grow with the number of images.

    path (joint cells, attributes) holds value numbers of the attributes in `crossed`; the others
    have one value. ends (joint cells,) are running sums of the joint cells' sizes.
    """

    spec: DatasetSpec
    levels: dict[Attribute, Level]
    crossed: tuple[Attribute, ...]
    path: npt.NDArray[np.uint16]
    ends: Ints
    step: int
    offset: int

    @classmethod
    def of(cls, spec: DatasetSpec) -> Self:
        """Plan a spec. The same spec gives the same plan everywhere."""
        levels = {attribute: _level(spec, attribute) for attribute in Attribute}
        crossed = spec.balanced()
        path, size = _fair_cells(tuple(tuple(levels[a].counts.tolist()) for a in crossed))
        offset = int(factor_rng(spec.seed, 0, "plan/offset").integers(spec.count))
        return cls(spec, levels, crossed, path, np.cumsum(size), _golden_step(spec.count), offset)

    @property
    def count(self) -> int:
        return self.spec.count

    @property
    def images_per_shard(self) -> int:
        return images_per_shard(self.spec)

    def shards(self) -> tuple[ShardRange, ...]:
        """Cut the images into index ranges of about a minute or two of work each."""
        return tuple(shard_ranges(self.count, self.images_per_shard))

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
            positions = (indices * self.step + self.offset) % self.count
            rows = np.searchsorted(self.ends, positions, side="right")
            for row in self.path[rows].tolist():
                for (place, words), number in zip(columns, row, strict=True):
                    fields[place] = words[number]
                yield Cell(*fields)

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
        level_a, level_b = self.levels[a], self.levels[b]
        shape = len(level_a.values), len(level_b.values)
        cells = self._column(a) * shape[1] + self._column(b)
        # Sums of whole numbers below 2**53 are exact in floats.
        sums = np.bincount(cells, weights=self._sizes, minlength=shape[0] * shape[1])
        table = sums.reshape(shape)
        rows = {value: number for number, value in enumerate(level_a.values)}
        columns = {value: number for number, value in enumerate(level_b.values)}
        pairs = itertools.product(self.spec.values_of(a), self.spec.values_of(b))
        return {(x, y): int(table[rows[x], columns[y]]) for x, y in pairs}

    def joint_extremes(self) -> tuple[int, int]:
        """Return the smallest and the largest count of a joint cell that the spec asks for."""
        asked = math.prod(np.count_nonzero(level.counts) for level in self.levels.values())
        sizes = self._sizes
        return (0 if sizes.size < asked else int(sizes.min())), int(sizes.max())

    def _column(self, attribute: Attribute) -> Ints:
        """Return the value number of every joint cell (joint cells,)."""
        if attribute not in self.crossed:
            return np.zeros(len(self.path), np.int64)
        return self.path[:, self.crossed.index(attribute)].astype(np.int64)

    @cached_property
    def _words(self) -> dict[Attribute, tuple[str, ...]]:
        """Return the values of every attribute, as members of their enumeration."""
        return {
            attribute: tuple(map(_ENUMERATIONS.get(attribute, str), level.values))
            for attribute, level in self.levels.items()
        }

    @cached_property
    def _sizes(self) -> Ints:
        return np.diff(self.ends, prepend=0)


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


@lru_cache(maxsize=16)
def _fair_cells(counts: tuple[tuple[int, ...], ...]) -> tuple[npt.NDArray[np.uint16], Ints]:
    shares = [np.array(of_attribute, np.int64) for of_attribute in counts]
    cells, size = even_pairs(*joint_cells(shares), shares)
    path = cells.astype(np.uint16)  # no attribute has 65,536 values
    path.flags.writeable = size.flags.writeable = False
    return path, size


def _level(spec: DatasetSpec, attribute: Attribute) -> Level:
    """Resolve a request into counts; the seed decides who is first where equal shares tie."""
    request, asked = spec.attributes[attribute], spec.values_of(attribute)
    if isinstance(request, dict):
        return Level(asked, np.array([request[value] for value in asked], np.int64))
    rng = factor_rng(spec.seed, 0, f"plan/{attribute.value}")
    shuffled = tuple(asked[i] for i in rng.permutation(len(asked)))
    share, extra = divmod(spec.count, len(shuffled))
    return Level(shuffled, share + (np.arange(len(shuffled)) < extra).astype(np.int64))


def _golden_step(count: int) -> int:
    """Return the step nearest count / golden ratio that visits every position."""
    step = max(1, round(count * (math.sqrt(5) - 1) / 2))
    while math.gcd(step, count) != 1:
        step += 1
    return step
