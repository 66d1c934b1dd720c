"""Which pixel centres lie in which triangles, in float64.

Most triangles of a hand cover a pixel or none, so triangles are grouped by the size of their
bounding boxes and each group is tested in one vectorised step.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from services.worker.label.projected import I8, all_of
from services.worker.label.projection import F8

CHUNK = 16_384
"""Pixel candidates tested at a time, to fit a processor's cache; changes nothing else."""
_SPANS = np.array([1, 2, 3, *(k << step for step in range(1, 24) for k in (2, 3))])
"""Boxes are tested as if they were so wide and tall."""


@dataclass(frozen=True, eq=False)
class Hits:
    """Pixel centres in triangles: pixel (N,) counted along rows, row (N,) of the triangles.

    areas (3, N): twice the area between the centre and the side opposite each corner; corners'
    shares of the point, once divided by their sum.
    """

    pixel: I8
    row: I8
    areas: F8


def twice_area(corners_px: F8) -> F8:
    """Return (T,) twice the signed area of triangles (T, 3, 2); y points down.

    Triangles that turn counter-clockwise as seen from outside have a negative area where their
    outside faces the camera.
    """
    a, b, c = np.moveaxis(corners_px, 1, 0)
    area: F8 = cross(b[:, 0] - a[:, 0], b[:, 1] - a[:, 1], c[:, 0] - a[:, 0], c[:, 1] - a[:, 1])
    return area


def scan(corners_px: F8, width_px: int, height_px: int) -> Iterator[Hits]:
    """Yield the hits of triangles (T, 3, 2), which face the camera, on the centres of a picture.

    A centre on a side that two triangles share is in at least one: both compare the same numbers.
    """
    a, b, c = np.moveaxis(corners_px, 1, 0)
    size = (width_px, height_px)
    least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    low = np.clip(np.ceil(least - 0.5), 0, size).astype(np.intp)
    high = np.clip(np.floor(most + 0.5), 0, size).astype(np.intp)
    span = high - low
    rows = np.flatnonzero(all_of(span > 0))
    kinds = np.searchsorted(_SPANS, span[rows])
    codes = (kinds[:, 0] * len(_SPANS) + kinds[:, 1]).astype(np.int16)
    order = np.argsort(codes, kind="stable")
    starts = np.flatnonzero(np.diff(codes[order], prepend=-1)).tolist()
    for start, end in pairwise([*starts, len(order)]):
        group = rows[order[start:end]]
        wide, tall = (int(_SPANS[kind]) for kind in divmod(int(codes[order[start]]), len(_SPANS)))
        step = max(1, CHUNK // (wide * tall))
        for first in range(0, len(group), step):
            part = group[first : first + step]
            yield _inside(corners_px, part, low[part], (wide, tall), size)


def _inside(
    corners_px: F8, rows: I8, low: I8, span: tuple[int, int], size: tuple[int, int]
) -> Hits:
    """Return the hits of triangles `rows` (G,) among centres `span` from their boxes' corners."""
    down, across = np.divmod(np.arange(span[0] * span[1]), span[0])
    x0, y0 = low[:, 0] + 0.5, low[:, 1] + 0.5
    x, y = x0[:, None] + across, y0[:, None] + down
    (ax, ay), (bx, by), (cx, cy) = (
        (corner[:, 0, None] - x, corner[:, 1, None] - y)
        for corner in np.moveaxis(corners_px[rows], 1, 0)
    )
    areas = (cross(bx, by, cx, cy), cross(cx, cy, ax, ay), cross(ax, ay, bx, by))
    hit = (areas[0] <= 0) & (areas[1] <= 0) & (areas[2] <= 0)
    if x0.size and (x[:, -1].max() >= size[0] or y[:, -1].max() >= size[1]):
        hit &= (x < size[0]) & (y < size[1])
    flat = np.flatnonzero(hit)
    which, place = np.divmod(flat, len(across))
    pixel = (low[which, 1] + down[place]) * size[0] + low[which, 0] + across[place]
    return Hits(pixel, rows[which], np.stack([area.ravel()[flat] for area in areas]))


def cross(ax: F8, ay: F8, bx: F8, by: F8) -> F8:
    """Return the third component of the cross product of plane vectors, element by element."""
    first = ax * by
    first -= ay * bx
    return first
