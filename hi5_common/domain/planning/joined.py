"""Orders made of other orders: with other numbers, side by side, or with every image as several."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hi5_common.domain.planning.order import Box, Order
from hi5_common.domain.planning.strand import Ints, Table


@dataclass(frozen=True, eq=False)
class Renumbered:
    """An order with other strands.

    columns: for each strand the place of one of the old ones (None: all images have one value) and
    the new numbers (n,) of its values.
    """

    order: Order
    columns: tuple[tuple[int | None, Ints], ...]
    sizes: tuple[int, ...]

    @property
    def stray(self) -> float:
        return self.order.stray

    @property
    def boxes(self) -> tuple[Box, ...]:
        return tuple(
            Box(
                tuple(
                    new[:1] if old is None else new[box.values[old]] for old, new in self.columns
                ),
                box.times,
            )
            for box in self.order.boxes
        )

    @cached_property
    def tables(self) -> tuple[tuple[Table, int], ...]:
        return tuple((self._renumbered(table), times) for table, times in self.order.tables)

    def rows(self, indices: Ints) -> Table:
        return self._renumbered(self.order.rows(indices))

    def _renumbered(self, table: Table) -> Table:
        rows = np.empty((len(table), len(self.columns)), dtype=np.uint16)
        for place, (old, new) in enumerate(self.columns):
            rows[:, place] = new[0] if old is None else new[table[:, old]]
        return rows


@dataclass(frozen=True, eq=False)
class Interleaved:
    """Orders side by side, each spread evenly over the images.

    stages: how many images of each part there are up to a point (points, parts). Between two
    points every part's images are spread evenly among the others, in their own order.
    """

    parts: tuple[Order, ...]
    stages: tuple[tuple[int, ...], ...]
    sizes: tuple[int, ...]

    @property
    def stray(self) -> float:
        return sum(part.stray for part in self.parts) + 1.0

    @property
    def boxes(self) -> tuple[Box, ...]:
        """Boxes of parts with the same values are one; of others no value is the same."""
        boxes = dict[tuple[bytes, ...], Box]()
        for box in (box for part in self.parts for box in part.boxes):
            values = tuple(np.unique(numbers) for numbers in box.values)
            key = tuple(numbers.tobytes() for numbers in values)
            before = boxes[key].times if key in boxes else 0
            boxes[key] = Box(values, before + box.times)
        return tuple(boxes.values())

    @property
    def tables(self) -> tuple[tuple[Table, int], ...]:
        return tuple(table for part in self.parts for table in part.tables)

    def rows(self, indices: Ints) -> Table:
        part, within = self.places(indices)
        rows = np.empty((len(indices), len(self.sizes)), dtype=np.uint16)
        for number, order in enumerate(self.parts):
            mine = part == number
            rows[mine] = order.rows(within[mine])
        return rows

    def places(self, indices: Ints) -> tuple[Ints, Ints]:
        """Return the part (K,) of each image, and its number (K,) within the part."""
        part, within = np.empty_like(indices), np.empty_like(indices)
        begun = (0,) * len(self.parts)
        for stage in self.stages:
            start, stop = sum(begun), sum(stage)
            here = (start <= indices) & (indices < stop)
            more = [after - before for before, after in zip(begun, stage, strict=True)]
            of_stage, place = _spread(indices[here] - start, more)
            part[here] = of_stage
            within[here] = place + np.array(begun, dtype=np.int64)[of_stage]
            begun = stage
        return part, within


def _spread(indices: Ints, counts: Sequence[int]) -> tuple[Ints, Ints]:
    """Return the part (K,) of images (K,) and the number within, every part spread evenly.

    The last part takes its images first, each as soon as its share is whole; the others so on
    among what is left.
    """
    part, left = np.zeros(len(indices), dtype=np.int64), indices.copy()
    free = np.ones(len(indices), dtype=np.bool_)
    total = sum(counts)
    for number in range(len(counts) - 1, 0, -1):
        came, comes = left * counts[number] // total, (left + 1) * counts[number] // total
        taken = free & (comes > came)
        part[taken] = number
        left = np.where(free, np.where(taken, came, left - came), left)
        free &= ~taken
        total -= counts[number]
        if not total:
            break
    return part, left


@dataclass(frozen=True, eq=False)
class Twinned:
    """An order of which every image comes once with each combination of some strands more.

    places: those strands, in order, among all. twins (twins, places) are their value numbers.
    """

    order: Order
    places: tuple[int, ...]
    twins: Table
    sizes: tuple[int, ...]

    @property
    def stray(self) -> float:
        return self.order.stray * len(self.twins)

    def within(self, place: int) -> int:
        """Return the place among the scenes' strands of a strand that twins have in common."""
        return place - sum(own < place for own in self.places)

    def having(self, place: int) -> Ints:
        """Return how many twins of a scene have each value (n,) of a strand that they differ in."""
        column = self.twins[:, self.places.index(place)]
        return np.bincount(column, minlength=self.sizes[place]).astype(np.int64)

    @property
    def boxes(self) -> tuple[Box, ...]:
        own = [np.unique(column) for column in self.twins.T]
        return tuple(Box(self._among(box.values, own), box.times) for box in self.order.boxes)

    @cached_property
    def tables(self) -> tuple[tuple[Table, int], ...]:
        return tuple((self._twinned(table), times) for table, times in self.order.tables)

    def rows(self, indices: Ints) -> Table:
        scenes = self.order.rows(indices // len(self.twins))
        return self._beside(scenes, self.twins[indices % len(self.twins)])

    def _twinned(self, table: Table) -> Table:
        scenes = np.repeat(table, len(self.twins), axis=0)
        return self._beside(scenes, np.tile(self.twins, (len(table), 1)))

    def _beside(self, scenes: Table, twins: Table) -> Table:
        columns = self._among(tuple(scenes.T), tuple(twins.T))
        return np.stack(columns, axis=1).astype(np.uint16) if columns else scenes

    def _among(self, others: Sequence[Ints], own: Sequence[Ints]) -> tuple[Ints, ...]:
        rest, mine = iter(others), dict(zip(self.places, own, strict=True))
        return tuple(
            mine[place] if place in mine else next(rest) for place in range(len(self.sizes))
        )
