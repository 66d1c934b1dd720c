"""The plan: which attribute values image i gets, computed from (spec, seed, i) and never stored.

The joint cells and their sizes come from `apportion.py` and `evening.py`: at most one number per
joint cell that the spec can make, however many images there are. Image indices visit the cells'
positions in golden-ratio steps, so that any run of images is a fair sample of the whole.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Self

import numpy as np

from hi5_common.domain.apportion import Ints, joint_cells
from hi5_common.domain.evening import even_pairs
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.sharding import ShardRange, images_per_shard, shard_ranges
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.vocabulary import (
    VALUES,
    Attribute,
    Environment,
    Gender,
    Handedness,
    Pose,
    SkinTone,
    Viewpoint,
)

ALGORITHM = "tree-2"
CHUNK = 1 << 14


@dataclass(frozen=True)
class Cell:
    """The attribute values of one image."""

    gender: Gender
    skin_tone: SkinTone
    pose: Pose
    environment: Environment
    handedness: Handedness
    viewpoint: Viewpoint

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
    """Every image's cell, with exact counts. Memory does not grow with the number of images."""

    spec: DatasetSpec
    levels: dict[Attribute, Level]
    path: Ints
    ends: Ints
    step: int
    offset: int

    @classmethod
    def of(cls, spec: DatasetSpec) -> Self:
        """Plan a spec. The same spec gives the same plan everywhere."""
        levels = {attribute: _level(spec, attribute) for attribute in Attribute}
        path, size = _fair_cells(tuple(tuple(lv.counts.tolist()) for lv in levels.values()))
        offset = int(factor_rng(spec.seed, 0, "plan/offset").integers(spec.count))
        return cls(spec, levels, path, np.cumsum(size), _golden_step(spec.count), offset)

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
        for low in range(start, stop, CHUNK):
            indices = np.arange(low, min(low + CHUNK, stop), dtype=np.int64)
            positions = (indices * self.step + self.offset) % self.count
            rows = np.searchsorted(self.ends, positions, side="right")
            for row in self.path[rows].tolist():
                yield _cell(*map(_pick, self.levels.values(), row))

    def value_counts(self, attribute: Attribute) -> dict[str, int]:
        """Return the exact number of images of each requested value, in canonical order."""
        level = self.levels[attribute]
        counts = dict(zip(level.values, level.counts.tolist(), strict=True))
        return {value: counts[value] for value in VALUES[attribute] if value in counts}

    def pair_counts(self, a: Attribute, b: Attribute) -> dict[tuple[str, str], int]:
        """Return the exact number of images of each pair of requested values."""
        order = list(self.levels)
        level_a, level_b = self.levels[a], self.levels[b]
        table = np.zeros((len(level_a.values), len(level_b.values)), np.int64)
        np.add.at(table, (self.path[:, order.index(a)], self.path[:, order.index(b)]), self._sizes)
        rows, columns = level_a.values.index, level_b.values.index
        pairs = itertools.product(self.value_counts(a), self.value_counts(b))
        return {(x, y): int(table[rows(x), columns(y)]) for x, y in pairs}

    def joint_extremes(self) -> tuple[int, int]:
        """Return the smallest and the largest count of a joint cell that the spec asks for."""
        asked = math.prod(np.count_nonzero(level.counts) for level in self.levels.values())
        sizes = self._sizes
        return (0 if sizes.size < asked else int(sizes.min())), int(sizes.max())

    @cached_property
    def _sizes(self) -> Ints:
        return np.diff(self.ends, prepend=0)


@lru_cache(maxsize=16)
def _fair_cells(counts: tuple[tuple[int, ...], ...]) -> tuple[Ints, Ints]:
    shares = [np.array(of_attribute, np.int64) for of_attribute in counts]
    path, size = even_pairs(*joint_cells(shares), shares)
    path.flags.writeable = size.flags.writeable = False
    return path, size


def _level(spec: DatasetSpec, attribute: Attribute) -> Level:
    """Resolve a request into counts; the seed decides who is first where equal shares tie."""
    request = spec.attributes[attribute]
    if isinstance(request, dict):
        asked = [value for value in VALUES[attribute] if value in request]
        return Level(tuple(asked), np.array([request[value] for value in asked], np.int64))
    asked = [value for value in VALUES[attribute] if request is None or value in request]
    rng = factor_rng(spec.seed, 0, f"plan/{attribute.value}")
    shuffled = tuple(asked[i] for i in rng.permutation(len(asked)))
    share, extra = divmod(spec.count, len(shuffled))
    return Level(shuffled, share + (np.arange(len(shuffled)) < extra).astype(np.int64))


def _pick(level: Level, number: int) -> str:
    return level.values[number]


def _golden_step(count: int) -> int:
    """Return the step nearest count / golden ratio that visits every position."""
    step = max(1, round(count * (math.sqrt(5) - 1) / 2))
    while math.gcd(step, count) != 1:
        step += 1
    return step


@cache
def _cell(gender: str, tone: str, pose: str, environment: str, hand: str, view: str) -> Cell:
    return Cell(
        Gender(gender),
        SkinTone(tone),
        Pose(pose),
        Environment(environment),
        Handedness(hand),
        Viewpoint(view),
    )
