"""A z-buffer in float64: which triangle each pixel centre sees, and how far away.

Most triangles of a hand cover a pixel or none, so triangles are grouped by the size of their
bounding boxes and each group is tested in one vectorised step.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.label.projected import I8, ProjectedMesh, all_of
from services.worker.label.projection import F8

CHUNK = 1 << 20
"""Pixel candidates tested at a time; bounds memory, changes nothing else."""

NO_TRIANGLE = -1


@dataclass(frozen=True, eq=False)
class Surface:
    """What each pixel centre sees.

    triangle (H, W) row of ProjectedMesh.triangles or -1; depth_m (H, W) along the optical axis,
    inf where there is nothing; weights (H, W, 3) perspective-correct barycentric weights.
    """

    triangle: I8
    depth_m: F8
    weights: F8

    @property
    def covered(self) -> npt.NDArray[np.bool_]:
        """Return (H, W) where there is a surface."""
        mask: npt.NDArray[np.bool_] = self.triangle != NO_TRIANGLE
        return mask

    def nearest_vertex(self, mesh: ProjectedMesh) -> I8:
        """Return (H, W) the vertex nearest to what is seen; meaningless where nothing is."""
        corner = self.weights.argmax(axis=-1)
        nearest: I8 = np.take_along_axis(mesh.triangles[self.triangle], corner[..., None], axis=-1)[
            ..., 0
        ]
        return nearest


def rasterise(mesh: ProjectedMesh) -> Surface:
    """Return the first surface at each pixel centre of the mesh's picture."""
    height, width = mesh.intrinsics.height_px, mesh.intrinsics.width_px
    nearness = np.zeros(height * width)
    triangle = np.full(height * width, np.iinfo(np.intp).max)
    candidates = list(_candidates(mesh))
    for pixel, near, _ in candidates:
        np.maximum.at(nearness, pixel, near)
    for pixel, near, row in candidates:
        first = near == nearness[pixel]
        np.minimum.at(triangle, pixel[first], row[first])
    triangle[nearness == 0] = NO_TRIANGLE
    return _surface(mesh, triangle.reshape(height, width))


def barycentric(mesh: ProjectedMesh, rows: I8, x_px: F8, y_px: F8) -> F8:
    """Return (N, 3) screen-space barycentric weights of points in triangles `rows` (N,)."""
    a, b, c = np.moveaxis(mesh.corners_px[rows], 1, 0)
    wa = _cross(b[:, 0] - x_px, b[:, 1] - y_px, c[:, 0] - x_px, c[:, 1] - y_px)
    wb = _cross(c[:, 0] - x_px, c[:, 1] - y_px, a[:, 0] - x_px, a[:, 1] - y_px)
    area = _cross(b[:, 0] - a[:, 0], b[:, 1] - a[:, 1], c[:, 0] - a[:, 0], c[:, 1] - a[:, 1])
    wa, wb = wa / area, wb / area
    return np.stack([wa, wb, 1.0 - wa - wb], axis=-1)


def _candidates(mesh: ProjectedMesh) -> Iterator[tuple[I8, F8, I8]]:
    """Yield (pixel, 1 / depth, triangle row) of every pixel centre inside a triangle."""
    least, most = mesh.bounds_px
    size = (mesh.intrinsics.width_px, mesh.intrinsics.height_px)
    low = np.clip(np.ceil(least - 0.5), 0, size).astype(np.intp)
    high = np.clip(np.floor(most + 0.5), 0, size).astype(np.intp)
    span = high - low
    # Of a closed surface only triangles that face the camera can be first; y points down, so
    # their outward (counter-clockwise) winding gives a negative area.
    rows = np.flatnonzero(all_of(span > 0) & (_twice_area(mesh.corners_px) < 0))
    spans = np.exp2(np.ceil(np.log2(span[rows]))).astype(np.intp)
    for wide, tall in np.unique(spans, axis=0):
        group = rows[all_of(spans == (wide, tall))]
        step = max(1, CHUNK // int(wide * tall))
        for start in range(0, len(group), step):
            yield _inside(mesh, group[start : start + step], low, high, (int(wide), int(tall)))


def _inside(
    mesh: ProjectedMesh, rows: I8, low: I8, high: I8, span: tuple[int, int]
) -> tuple[I8, F8, I8]:
    dy, dx = np.divmod(np.arange(span[0] * span[1]), span[0])
    x, y = (low[rows, 0, None] + dx).ravel(), (low[rows, 1, None] + dy).ravel()
    row = np.repeat(rows, dx.size)
    boxed = (x < high[row, 0]) & (y < high[row, 1])
    x, y, row = x[boxed], y[boxed], row[boxed]
    weights = barycentric(mesh, row, x + 0.5, y + 0.5)
    hit = all_of(weights >= 0)
    x, y, row, weights = x[hit], y[hit], row[hit], weights[hit]
    nearness = 1.0 / mesh.vertices_camera_m[mesh.triangles[row], 2]
    return y * mesh.intrinsics.width_px + x, (weights * nearness).sum(axis=-1), row


def _surface(mesh: ProjectedMesh, triangle: I8) -> Surface:
    depth = np.full(triangle.shape, np.inf)
    weights = np.zeros((*triangle.shape, 3))
    y, x = np.nonzero(triangle != NO_TRIANGLE)
    rows = triangle[y, x]
    screen = barycentric(mesh, rows, x + 0.5, y + 0.5)
    per_corner = screen / mesh.vertices_camera_m[mesh.triangles[rows], 2]
    nearness = per_corner.sum(axis=-1)
    depth[y, x] = 1.0 / nearness
    weights[y, x] = per_corner / nearness[:, None]
    return Surface(triangle, depth, weights)


def _cross(ax: F8, ay: F8, bx: F8, by: F8) -> F8:
    return ax * by - ay * bx


def _twice_area(corners: F8) -> F8:
    a, b, c = np.moveaxis(corners, 1, 0)
    return _cross(b[:, 0] - a[:, 0], b[:, 1] - a[:, 1], c[:, 0] - a[:, 0], c[:, 1] - a[:, 1])
