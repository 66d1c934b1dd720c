"""Which points lie near which: a grid of cells, in numpy alone."""

import numpy as np
import numpy.typing as npt

from services.worker.hand.model import F8

I8 = npt.NDArray[np.int64]


CELLS_A_RADIUS = 2
"""Finer cells hold fewer points that are too far, but cost more look-ups."""
_OFFSETS = range(-CELLS_A_RADIUS, CELLS_A_RADIUS + 1)
_LINES = np.array([(j, k) for k in _OFFSETS for j in _OFFSETS if j * j + k * k < 8])


def near_pairs(points_m: F8, others_m: F8, radius_m: float) -> tuple[I8, I8]:
    """Rows (P,), (P,) of every point (N,3) and other point (M,3) at most radius_m apart.

    Ordered by the point's row; the order of its partners is fixed by the input alone.
    """
    if not len(points_m) or not len(others_m):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    side_m = radius_m / CELLS_A_RADIUS
    origin = np.minimum(points_m.min(axis=0), others_m.min(axis=0)) - 2.0 * radius_m
    cells = np.floor((others_m - origin) / side_m).astype(np.int64)
    at = np.floor((points_m - origin) / side_m).astype(np.int64)
    size = np.maximum(cells.max(axis=0), at.max(axis=0)) + CELLS_A_RADIUS + 1
    keys = (cells[:, 2] * size[1] + cells[:, 1]) * size[0] + cells[:, 0]
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    line = (at[:, None, 2] + _LINES[:, 1]) * size[1] + at[:, None, 1] + _LINES[:, 0]
    start = (line * size[0] + at[:, None, 0]).reshape(-1)
    first = np.searchsorted(keys, start - CELLS_A_RADIUS)
    count = np.searchsorted(keys, start + CELLS_A_RADIUS, side="right") - first
    point = np.repeat(np.repeat(np.arange(len(points_m)), len(_LINES)), count)
    other = order[np.repeat(first, count) + within(count)]
    apart = points_m[point] - others_m[other]
    near = np.einsum("nk,nk->n", apart, apart) <= radius_m * radius_m
    return point[near], other[near]


def within(counts: I8) -> I8:
    """0, 1, ... counts[0]-1, 0, 1, ... counts[1]-1, ..."""
    ends = np.cumsum(counts)
    positions: I8 = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts, counts)
    return positions
