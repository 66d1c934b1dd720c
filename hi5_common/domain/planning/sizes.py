"""How many images of an order have a value, a pair of values, or a whole combination of them."""

import math
from collections.abc import Sequence

import numpy as np

from hi5_common.domain.planning.order import Order
from hi5_common.domain.planning.strand import Ints, Table


def value_sizes(order: Order, place: int) -> Ints:
    """Return the number of images (n,) of each value number of a strand."""
    size = order.sizes[place]
    periods = order.periods * math.prod(order.sizes) // size
    sizes = np.full(size, periods, dtype=np.int64)
    for table, times in order.tables:
        sizes += times * np.bincount(table[:, place], minlength=size)
    return sizes


def pair_sizes(order: Order, a: int, b: int) -> Ints:
    """Return the number of images (n_a, n_b) of each pair of value numbers of two strands."""
    shape = order.sizes[a], order.sizes[b]
    periods = order.periods * math.prod(order.sizes) // math.prod(shape)
    sizes = np.full(math.prod(shape), periods, dtype=np.int64)
    for table, times in order.tables:
        code = table[:, a].astype(np.intp) * shape[1] + table[:, b]
        sizes += times * np.bincount(code, minlength=sizes.size)
    return sizes.reshape(shape)


def joint_extremes(order: Order) -> tuple[int, int]:
    """Return the smallest and the largest number of images of any combination of value numbers."""
    rows = np.concatenate([table for table, _ in order.tables])
    times = np.repeat([n for _, n in order.tables], [len(table) for table, _ in order.tables])
    _, cell = np.unique(_codes(rows, order.sizes), return_inverse=True)
    sizes = np.bincount(cell, weights=times).astype(np.int64)
    asked = math.prod(int(np.count_nonzero(value_sizes(order, k))) for k in range(len(order.sizes)))
    least = 0 if len(sizes) < asked else int(sizes.min())
    return least + order.periods, int(sizes.max(initial=0)) + order.periods


def _codes(rows: Table, sizes: Sequence[int]) -> Ints:
    """Return a number for each row's combination, the same for the same combination."""
    code, codes = np.zeros(len(rows), dtype=np.int64), 1
    for column, size in zip(rows.T, sizes, strict=True):
        if codes * size >= 1 << 62:
            _, code = np.unique(code, return_inverse=True)
            codes = len(rows)
        code, codes = code * size + column, codes * size
    return code
