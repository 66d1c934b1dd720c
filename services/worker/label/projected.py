"""The posed mesh as the camera sees it: triangles in pixels and in depth."""

from dataclasses import dataclass
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
    return ProjectedMesh(
        camera.intrinsics, pixels, camera_m, triangles[seen[triangles].all(axis=1)]
    )


def triangulate(quads: npt.NDArray[np.integer[Any]]) -> I8:
    """Return the (2 G, 3) triangles of (G, 4) quads, the two of a quad after one another."""
    wide = quads.astype(np.intp)
    return wide[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
