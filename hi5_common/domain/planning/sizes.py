"""How many images of an order have a value, a pair of values, or a whole combination of them."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hi5_common.domain.planning.joined import Twinned
from hi5_common.domain.planning.order import Box, Order
from hi5_common.domain.planning.strand import Ints, Table


def value_sizes(order: Order, place: int) -> Ints:
    """Return the number of images (n,) of each value number of a strand."""
    if isinstance(order, Twinned):
        if place in order.places:
            scenes = int(value_sizes(order.order, 0).sum()) if order.order.sizes else 0
            return scenes * order.having(place)
        return len(order.twins) * value_sizes(order.order, order.within(place))
    size = order.sizes[place]
    sizes = np.zeros(size, dtype=np.int64)
    for box in order.boxes:
        sizes[box.values[place]] += _times(box, [place])
    for table, times in order.tables:
        sizes += times * np.bincount(table[:, place], minlength=size)
    return sizes


def pair_sizes(order: Order, a: int, b: int) -> Ints:
    """Return the number of images (n_a, n_b) of each pair of value numbers of two strands."""
    if isinstance(order, Twinned) and not {a, b} & set(order.places):
        return len(order.twins) * pair_sizes(order.order, order.within(a), order.within(b))
    if isinstance(order, Twinned):
        # Every scene has every twin, so that the twins' strands are independent of all others.
        first, second = value_sizes(order, a), value_sizes(order, b)
        return np.outer(first, second) // max(int(first.sum()), 1)
    return cell_sizes(order, (a, b))


def cell_sizes(order: Order, places: Sequence[int]) -> Ints:
    """Return the number of images (n_a, n_b, ...) of each combination of some strands."""
    shape = tuple(order.sizes[place] for place in places)
    sizes = np.zeros(shape, dtype=np.int64)
    for box in order.boxes:
        sizes[np.ix_(*(box.values[place] for place in places))] += _times(box, places)
    for table, times in order.tables:
        code = np.ravel_multi_index([table[:, place].astype(np.intp) for place in places], shape)
        sizes += times * np.bincount(code, minlength=sizes.size).reshape(shape)
    return sizes


def joint_extremes(order: Order) -> tuple[int, int]:
    """Return the smallest and the largest number of images of any combination of value numbers."""
    if isinstance(order, Twinned):  # a combination has as many images as its scenes have
        return joint_extremes(order.order)
    rows = np.concatenate([table for table, _ in order.tables])
    times = np.repeat([n for _, n in order.tables], [len(table) for table, _ in order.tables])
    _, first, cell = np.unique(_codes(rows, order.sizes), return_index=True, return_inverse=True)
    sizes = np.bincount(cell, weights=times).astype(np.int64)
    cells = rows[first]
    asked = math.prod(int(np.count_nonzero(value_sizes(order, k))) for k in range(len(order.sizes)))
    extremes, left = list[tuple[int, int]](), np.ones(len(cells), dtype=np.bool_)
    for box in order.boxes:
        inside = _inside(box, cells)
        volume = math.prod(map(len, box.values))
        extremes.append(_extremes(sizes[inside], volume, box.times))
        left &= ~inside
        asked -= volume
    extremes.append(_extremes(sizes[left], asked, 0))
    lows, highs = zip(*(pair for pair in extremes if pair[1]), strict=True)
    return min(lows), max(highs)


def _extremes(sizes: Ints, volume: int, more: int) -> tuple[int, int]:
    """Return the extremes among `volume` combinations, of which some have `sizes` images (k,) and
    all have `more` beside; nothing of nothing.
    """
    if not volume:
        return 0, 0
    least = int(sizes.min()) if len(sizes) == volume else 0
    return least + more, int(sizes.max(initial=0)) + more


def _times(box: Box, places: Sequence[int]) -> int:
    """Return how often a box has each combination of values of some strands."""
    return box.times * math.prod(len(v) for k, v in enumerate(box.values) if k not in places)


def _inside(box: Box, cells: Table) -> npt.NDArray[np.bool_]:
    """Tell of combinations (k, strands) which are in a box."""
    columns = zip(cells.T, box.values, strict=True)
    inside = np.ones(len(cells), dtype=np.bool_)
    for column, values in columns:
        inside &= np.isin(column, values)
    return inside


def _codes(rows: Table, sizes: Sequence[int]) -> Ints:
    """Return a number for each row's combination, the same for the same combination."""
    code, codes = np.zeros(len(rows), dtype=np.int64), 1
    for column, size in zip(rows.T, sizes, strict=True):
        if codes * size >= 1 << 62:
            _, code = np.unique(code, return_inverse=True)
            codes = len(rows)
        code, codes = code * size + column, codes * size
    return code
