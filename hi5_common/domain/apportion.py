"""Whole numbers out of shares: joint cells whose counts add up exactly and are as even as can be.

The cells are the leaves of a tree with one level per attribute. Splitting a node of m images by
an attribute with shares c_w / N gives each child the whole part of m c_w / N and leaves a few
images over; those go to the children whose pairs with the attributes above have fallen furthest
behind. All arithmetic is in whole numbers, so every machine finds the same cells.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]

_LOWEST = np.iinfo(np.int64).min


def joint_cells(shares: Sequence[Ints]) -> tuple[Ints, Ints]:
    """Apportion N images among joint cells.

    shares: for each attribute its exact counts (n_a,), each adding up to N. Returns the cells in
    use, (cells, attributes) value numbers, and their sizes (cells,) >= 1. For every attribute the
    sizes add up to its counts exactly; a child of a node of m images has the floor or ceiling of
    its share of m, unless skewed counts leave no other way.
    """
    path, size = np.zeros((1, 0), np.int64), np.array([shares[0].sum()], np.int64)
    for level, counts in enumerate(shares):
        table = _split(path, size, counts, [above.size for above in shares[:level]])
        node, value = np.nonzero(table)
        path = np.concatenate([path[node], value[:, None]], axis=1)
        size = table[node, value]
    return path, size


def _split(path: Ints, size: Ints, counts: Ints, above: Sequence[int]) -> Ints:
    """Split every node of a level: (nodes, attributes), (nodes,), (n,) -> (nodes, n) counts."""
    weights = np.ones_like(counts) if np.ptp(counts) <= 1 and counts.min() > 0 else counts
    unit = int(weights.sum())
    whole, part = np.divmod(size[:, None] * weights, unit)
    offsets = 1 + np.concatenate([[0], np.cumsum(above, dtype=np.int64)])
    rows = np.concatenate([np.zeros((len(path), 1), np.int64), path + offsets[:-1]], axis=1)
    lags = np.zeros((int(offsets[-1]), counts.size), np.int64)
    extra = _deal_rest(rows, part, size - whole.sum(axis=1), unit, lags)
    _make_exact(extra, part, counts - whole.sum(axis=0), rows, unit, lags)
    return np.asarray(whole + extra, dtype=np.int64)


def _deal_rest(rows: Ints, part: Ints, rest: Ints, unit: int, lags: Ints) -> Ints:
    """Give each node's left-over images to the children whose pairs lag most: (nodes, n) extras.

    lags (m, n) says how far each pair has fallen behind, in 1/unit of an image; rows (nodes, k)
    are the rows of lags that a node touches: its values above, and row 0 for the attribute alone.
    """
    extra = np.zeros_like(part)
    lefts = rest.tolist()
    for node in np.flatnonzero(rest).tolist():  # a node with nothing left over has no part either
        touched, gained = rows[node], part[node]
        lag = lags[touched] + gained
        score = np.where(gained == 0, _LOWEST, lag.sum(axis=0))
        chosen = (-score).argsort(kind="stable")[: lefts[node]]
        extra[node, chosen] = 1
        lag[:, chosen] -= unit
        lags[touched] = lag
    return extra


def _make_exact(extra: Ints, part: Ints, wanted: Ints, rows: Ints, unit: int, lags: Ints) -> None:
    """Move left-over images between children of one node until each value has its exact number."""
    surplus = extra.sum(axis=0) - wanted
    while np.any(surplus):
        giver, taker = int(np.argmax(surplus)), int(np.argmin(surplus))
        movable = (extra[:, giver] > 0) & (extra[:, taker] == 0) & (part[:, taker] > 0)
        if not movable.any():
            movable = extra[:, giver] > 0
        gain = lags[rows, taker].sum(axis=1) - lags[rows, giver].sum(axis=1)
        node = int(np.argmax(np.where(movable, gain, _LOWEST)))
        extra[node, [giver, taker]] += (-1, 1)
        lags[rows[node], giver] += unit
        lags[rows[node], taker] -= unit
        surplus[[giver, taker]] += (-1, 1)
