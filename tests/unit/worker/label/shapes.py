"""Simple closed surfaces in front of simple cameras."""

import numpy as np

from services.worker.label.projection import F8
from services.worker.ornaments.mesh import OrnamentMaterial, OrnamentMesh, OrnamentName
from services.worker.scene.types import Camera, Intrinsics, SceneGeometry

LENS = Intrinsics(100.0, 80.0, 31.5, 20.25, 64, 48)
CAMERA = Camera(LENS, np.eye(4))
"""At the origin, along +z, y down."""

_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
    dtype=np.int32,
)


def box(middle_m: tuple[float, float, float], half_m: tuple[float, float, float]) -> F8:
    """Return the (8, 3) corners of a box."""
    corners: F8 = _CORNERS * half_m + middle_m
    return corners


def scene_of(boxes: list[F8], parts: list[int], keypoints_m: F8 | None = None) -> SceneGeometry:
    """Return boxes as one surface, each of one part."""
    quads = np.concatenate([_QUADS + 8 * number for number in range(len(boxes))])
    count = 8 * len(boxes)
    return SceneGeometry(
        vertices_m=np.concatenate(boxes),
        quads=quads.astype(np.int32),
        uvs=np.zeros((len(quads), 4, 2), dtype=np.float32),
        nail=np.zeros(count),
        palm=np.zeros(count),
        slack=np.ones(count),
        part=np.repeat(np.array(parts, dtype=np.int32), 8),
        keypoints_m=np.zeros((21, 3)) if keypoints_m is None else keypoints_m,
    )


def worn_box(name: OrnamentName, middle_m: tuple[float, float, float]) -> OrnamentMesh:
    """Return a small box as an ornament."""
    corners = box(middle_m, (0.008, 0.008, 0.008))
    uvs = np.zeros((len(_QUADS), 4, 2), dtype=np.float32)
    return OrnamentMesh(name, corners, _QUADS, uvs, smooth=False, material=_PAINT)


_PAINT = OrnamentMaterial((0.5, 0.5, 0.5))
