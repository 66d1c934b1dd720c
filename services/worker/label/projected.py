"""The posed mesh as the camera sees it: triangles in pixels and in depth."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from services.worker.label.projection import F8, to_camera, to_pixels
from services.worker.ornaments.mesh import OrnamentMesh
from services.worker.scene.types import Camera, Intrinsics, SceneGeometry

I8 = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class ProjectedMesh:
    """vertices_px (W, 2), NaN behind the camera; vertices_camera_m (W, 3); triangles (T, 3).

    Only triangles wholly in front of the camera are kept: one that is cut by the plane NEAR_M in
    front of the lens would be at most a few millimetres of skin touching the lens.
    """

    intrinsics: Intrinsics
    vertices_px: F8
    vertices_camera_m: F8
    triangles: I8
    whole: bool = True
    """Whether every triangle is kept."""

    @cached_property
    def corners_px(self) -> F8:
        """Return the triangles' corners (T, 3, 2), gathered once for all who ask."""
        return self.vertices_px[self.triangles]

    @cached_property
    def bounds_px(self) -> tuple[F8, F8]:
        """Return the triangles' least and greatest coordinates, (T, 2) each."""
        a, b, c = (self.corners_px[:, k] for k in range(3))
        return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def all_of(three: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Return (N,) whether all of (N, K) hold: for a small K much faster than numpy's own."""
    found = three[:, 0].copy()
    for column in range(1, three.shape[1]):
        found &= three[:, column]
    return found


def project_mesh(camera: Camera, geometry: SceneGeometry) -> ProjectedMesh:
    """Project a hand, and after it what it wears; quads are cut along their first diagonal, as
    Blender cuts them.
    """
    surfaces: tuple[SceneGeometry | OrnamentMesh, ...] = (geometry, *geometry.ornaments)
    vertices_m = np.concatenate([surface.vertices_m for surface in surfaces])
    starts = np.cumsum([0, *(len(surface.vertices_m) for surface in surfaces[:-1])])
    quads = [surface.quads + start for surface, start in zip(surfaces, starts, strict=True)]
    camera_m = to_camera(camera, vertices_m)
    pixels = to_pixels(camera.intrinsics, camera_m)
    triangles = triangulate(np.concatenate(quads))
    seen = ~np.isnan(pixels[:, 0])
    kept = all_of(seen[triangles])
    return ProjectedMesh(
        camera.intrinsics, pixels, camera_m, triangles[kept], whole=bool(kept.all())
    )


def triangulate(quads: npt.NDArray[np.integer[Any]]) -> I8:
    """Return the (2 G, 3) triangles of (G, 4) quads, the two of a quad after one another."""
    wide = quads.astype(np.intp)
    return wide[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
