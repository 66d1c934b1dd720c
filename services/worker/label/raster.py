"""A z-buffer in float64: which triangle each pixel centre sees, and how far away."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from services.worker.label.projected import I8, ProjectedMesh
from services.worker.label.projection import F8
from services.worker.label.scan import cross, scan, twice_area

NO_TRIANGLE = -1


@dataclass(frozen=True, eq=False)
class Surface:
    """What each pixel centre of a mesh's picture sees.

    triangle (H, W): row of ProjectedMesh.triangles or -1.
    """

    mesh: ProjectedMesh
    triangle: I8

    @cached_property
    def covered(self) -> npt.NDArray[np.bool_]:
        """Return (H, W) where there is a surface."""
        mask: npt.NDArray[np.bool_] = self.triangle != NO_TRIANGLE
        return mask

    @cached_property
    def depth_m(self) -> F8:
        """Return (H, W) how far away it is along the optical axis; inf where there is nothing."""
        depth = np.full(self.triangle.shape, np.inf)
        depth[self.covered] = 1.0 / self._per_corner.sum(axis=-1)
        return depth

    @cached_property
    def weights(self) -> F8:
        """Return the (H, W, 3) perspective-correct barycentric weights; 0 where is nothing."""
        weights = np.zeros((*self.triangle.shape, 3))
        weights[self.covered] = self._per_corner / self._per_corner.sum(axis=-1, keepdims=True)
        return weights

    @cached_property
    def _per_corner(self) -> F8:
        """Return what each corner adds (N, 3) to 1 / depth of the covered pixels."""
        y, x = np.nonzero(self.covered)
        rows = self.triangle[y, x]
        screen = barycentric(
            self.mesh, rows, x.astype(np.float64) + 0.5, y.astype(np.float64) + 0.5
        )
        added: F8 = screen / self.mesh.vertices_camera_m[self.mesh.triangles[rows], 2]
        return added

    @cached_property
    def nearest_vertex(self) -> I8:
        """Return (H, W) the vertex nearest to what is seen; meaningless where nothing is."""
        corner = self.weights.argmax(axis=-1)
        corners = self.mesh.triangles[self.triangle]
        nearest: I8 = np.take_along_axis(corners, corner[..., None], axis=-1)[..., 0]
        return nearest


def rasterise(mesh: ProjectedMesh) -> Surface:
    """Return the first surface at each pixel centre of the mesh's picture.

    Of closed surfaces only triangles that face the camera can be first. Of two equally near ones
    it is the earlier.
    """
    height, width = mesh.intrinsics.height_px, mesh.intrinsics.width_px
    facing = np.flatnonzero(twice_area(mesh.corners_px) < 0)
    corner_nearness = 1.0 / mesh.vertices_camera_m[mesh.triangles[facing].T, 2]
    nearness = np.zeros(height * width)
    first = np.full(height * width, len(facing), dtype=np.intp)
    found = []
    for hits in scan(mesh.corners_px[facing], width, height):
        near = (hits.areas * corner_nearness[:, hits.row]).sum(axis=0) / hits.areas.sum(axis=0)
        np.maximum.at(nearness, hits.pixel, near)
        found.append((hits.pixel, hits.row, near))
    for pixel, row, near in found:
        ahead = near == nearness[pixel]
        np.minimum.at(first, pixel[ahead], row[ahead])
    triangle = np.append(facing, NO_TRIANGLE)[first]
    return Surface(mesh, triangle.reshape(height, width))


def barycentric(mesh: ProjectedMesh, rows: I8, x_px: F8, y_px: F8) -> F8:
    """Return (N, 3) screen-space barycentric weights of points in triangles `rows` (N,)."""
    a, b, c = np.moveaxis(mesh.corners_px[rows], 1, 0)
    wa = cross(b[:, 0] - x_px, b[:, 1] - y_px, c[:, 0] - x_px, c[:, 1] - y_px)
    wb = cross(c[:, 0] - x_px, c[:, 1] - y_px, a[:, 0] - x_px, a[:, 1] - y_px)
    area = twice_area(mesh.corners_px[rows])
    wa, wb = wa / area, wb / area
    return np.stack([wa, wb, 1.0 - wa - wb], axis=-1)
