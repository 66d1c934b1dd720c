"""How deep a closed surface passes through itself: measured, not estimated.

The measure shares nothing with the solver or with soft contact. A point of the skin is at fault
when the point just outside it has a winding number above zero: it lies inside flesh. The depth is
then the way to the skin it has to leave by. Winding numbers are counted exactly, as signed
crossings of a ray with the triangles.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.hand.contact.near import near_pairs, within
from services.worker.hand.model import F8, I4
from services.worker.hand.rotation import unit

I8 = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

OUTSIDE_M = 5e-5
"""How far outside the skin its points are tested: what touches is not inside."""
CELL_M = 1.2e-3
"""Cells into which rays and triangles are sorted, across the rays."""
EXIT_COSINE = 0.7
"""A way out leaves through the skin along its normal, within 45 degrees; the skin round a point
of a fingertip is met at a glancing angle and is no way out."""
FARTHEST_GAP_M = 0.02
FACING = -0.3
"""Cosine between the normals of skin that faces the point's own."""
FIRST_SEARCH_M, LAST_SEARCH_M = 0.004, 0.1
_RAY = unit(np.array([0.3517, 0.2113, 0.9119]))
"""The rays' direction: none of the hand's own."""


@dataclass(frozen=True, eq=False)
class Penetration:
    """Points of the skin that lie inside flesh: rows (N,) of the points, depths (N,) in metres."""

    rows: I8
    depths_m: F8

    @property
    def deepest_m(self) -> float:
        """The greatest depth, 0 when no point is inside."""
        return float(self.depths_m.max(initial=0.0))


def self_penetration(vertices_m: F8, quads: I4) -> Penetration:
    """Which vertices, then face centres, of a closed quad mesh lie inside it, and how deep.

    vertices_m (V,3); quads (F,4) outward. Rows below V are vertices, from V on faces.
    """
    corners = vertices_m[quads]
    face_normals = unit(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    # The middle of the diagonal along which the quad is split: a point of the surface measured.
    points = np.concatenate([vertices_m, (corners[:, 0] + corners[:, 2]) / 2.0])
    normals = np.concatenate([_vertex_normals(face_normals, quads, len(vertices_m)), face_normals])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    tested = points + OUTSIDE_M * normals
    rows = np.flatnonzero(winding_numbers(tested, vertices_m[faces]) > 0)
    return Penetration(rows, exit_distances_m(tested[rows], normals[rows], vertices_m[faces]))


def gap_m(vertices_m: F8, quads: I4, first: Mask, second: Mask) -> float:
    """The way in metres from the vertices (V,) of one patch to the faces of the other.

    Faces belong to a patch with all their corners. inf beyond FARTHEST_GAP_M.
    """
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    ways = []
    for points, patch in ((first, second), (second, first)):
        corners = vertices_m[faces[patch[faces].all(axis=1)]]
        point, triangle = near_pairs(vertices_m[points], corners.mean(axis=1), FARTHEST_GAP_M)
        if len(point):
            ends = closest_points_m(vertices_m[points][point], corners[triangle])
            ways.append(np.linalg.norm(ends - vertices_m[points][point], axis=1).min())
    return float(min(ways, default=np.inf))


def _vertex_normals(face_normals: F8, quads: I4, count: int) -> F8:
    rows = quads.reshape(-1)
    repeated = np.repeat(face_normals, 4, axis=0)
    total = np.stack([np.bincount(rows, repeated[:, k], count) for k in range(3)], axis=1)
    return unit(total)


def winding_numbers(points_m: F8, corners_m: F8) -> I8:
    """How often the closed surface of triangles (T,3,3) goes round each point (N,3): (N,) integer.

    0 outside, 1 inside, 2 where flesh overlaps: the signed crossings of a ray from the point.
    """
    frame = _frame(_RAY)
    rays, corners = points_m @ frame.T, corners_m @ frame.T
    triangle, ray = _near_pairs(rays[:, :2], corners[:, :, :2])
    a, b, c = np.moveaxis(corners[triangle], 1, 0)
    p = rays[ray]
    u, v, w = _cross(b - p, c - p), _cross(c - p, a - p), _cross(a - p, b - p)
    up = (u >= 0) & (v >= 0) & (w > 0) | (u >= 0) & (v > 0) & (w >= 0) | (u > 0)
    up &= (u >= 0) & (v >= 0) & (w >= 0)
    down = (u <= 0) & (v <= 0) & (w <= 0) & ~((u == 0) & (v == 0) & (w == 0))
    area = u + v + w
    crossed = (up | down) & (area != 0)
    height = (u * a[:, 2] + v * b[:, 2] + w * c[:, 2]) / np.where(area == 0, 1.0, area)
    crossed &= height > p[:, 2]
    signs = np.where(up, 1.0, -1.0) * crossed
    return np.rint(np.bincount(ray, signs, len(points_m))).astype(np.int64)


def exit_distances_m(points_m: F8, normals: F8, corners_m: F8) -> F8:
    """How far each point (N,3) inside is from the nearest skin that it can leave by: (N,) metres.

    It leaves through a triangle from behind: nearly along the triangle's normal, or where the skin
    faces the point's own (normals (N,3)), as it does in a fold.
    """
    planes = unit(
        np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]) + 1e-30
    )
    middles = corners_m.mean(axis=1)
    reach = float(np.linalg.norm(corners_m - middles[:, None], axis=2).max())
    exits = np.full(len(points_m), np.inf)
    radius = FIRST_SEARCH_M
    while np.isinf(exits).any() and radius < LAST_SEARCH_M:
        left = np.flatnonzero(np.isinf(exits))
        point, triangle = near_pairs(points_m[left], middles, radius + reach)
        way = closest_points_m(points_m[left[point]], corners_m[triangle]) - points_m[left[point]]
        length = np.linalg.norm(way, axis=1)
        cosine = np.einsum("nk,nk->n", way, planes[triangle]) / np.maximum(length, 1e-12)
        facing = np.einsum("nk,nk->n", normals[left[point]], planes[triangle])
        out = (cosine >= EXIT_COSINE) | ((facing < FACING) & (cosine > 0.0))
        out &= (length > 1e-9) & (length <= radius)
        np.minimum.at(exits, left[point[out]], length[out])
        radius *= 2.0
    return exits


def closest_points_m(points_m: F8, corners_m: F8) -> F8:
    """The point of each triangle (N,3,3) that is nearest to its point (N,3): (N,3).

    The foot of the perpendicular where it falls inside, else the nearest foot on an edge.
    """
    a, b, c = np.moveaxis(corners_m, 1, 0)
    normal = np.cross(b - a, c - a)
    square = np.einsum("tk,tk->t", normal, normal) + 1e-40
    foot: F8 = points_m - normal * (np.einsum("tk,tk->t", points_m - a, normal) / square)[:, None]
    inside = np.ones(len(a), dtype=np.bool_)
    best = np.full(len(a), np.inf)
    nearest: F8 = foot.copy()
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        inside &= np.einsum("tk,tk->t", np.cross(edge, foot - start), normal) >= 0
        along = np.einsum("tk,tk->t", points_m - start, edge)
        share = np.clip(along / (np.einsum("tk,tk->t", edge, edge) + 1e-40), 0.0, 1.0)
        on_edge = start + share[:, None] * edge
        distance = np.linalg.norm(on_edge - points_m, axis=1)
        closer = distance < best
        nearest[closer], best[closer] = on_edge[closer], distance[closer]
    nearest[inside] = foot[inside]
    return nearest


def _frame(ray: F8) -> F8:
    """Rotation (3,3) whose third row is the ray."""
    across = unit(np.cross(ray, np.array([1.0, 0.0, 0.0])))
    return np.stack([across, np.cross(ray, across), ray])


def _cross(a: F8, b: F8) -> F8:
    product: F8 = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def _near_pairs(points: F8, corners: F8) -> tuple[I8, I8]:
    """Rows (triangle, point) of all points in a cell that a triangle's box reaches, in 2D."""
    origin = np.minimum(points.min(axis=0), corners.min(axis=(0, 1))) - CELL_M
    cell = np.floor((points - origin) / CELL_M).astype(np.int64)
    low = np.floor((corners.min(axis=1) - origin) / CELL_M).astype(np.int64)
    high = np.floor((corners.max(axis=1) - origin) / CELL_M).astype(np.int64)
    width = int(max(cell[:, 0].max(), high[:, 0].max())) + 1
    order = np.argsort(cell[:, 1] * width + cell[:, 0], kind="stable")
    keys = (cell[:, 1] * width + cell[:, 0])[order]
    rows_of = high[:, 1] - low[:, 1] + 1
    triangle = np.repeat(np.arange(len(corners)), rows_of)
    line = low[triangle, 1] + within(rows_of)
    first = np.searchsorted(keys, line * width + low[triangle, 0])
    last = np.searchsorted(keys, line * width + high[triangle, 0], side="right")
    count = last - first
    return np.repeat(triangle, count), order[np.repeat(first, count) + within(count)]
