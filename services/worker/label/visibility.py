"""Which keypoints show, and what hides the others, by exact ray casting in float64.

Keypoints lie in the middle of the finger, so there is always skin in front of them. A point counts
as VISIBLE when the first surface on its line of sight is its own flesh: skin of one of the parts
that meet at the joint, no further in front of the point than the flesh there is thick. Skin of any
other part, or own skin further in front (a finger seen end-on, a palm seen edge-on), hides it, and
so does a ring, a bracelet, a watch or a sleeve.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import KEYPOINTS, KeypointVisibility
from services.worker.hand.parts import KEYPOINT_PARTS, HandPart
from services.worker.label.occluders import OCCLUDERS
from services.worker.label.projected import I8, ProjectedMesh, all_of
from services.worker.label.projection import F8, NEAR_M, in_frame
from services.worker.label.raster import barycentric
from services.worker.ornaments.mesh import OrnamentName

_WRIST_MM = 55.0
_THUMB_MM = (35.0, 28.0, 24.0, 20.0)
_FINGER_MM = (32.0, 23.0, 20.0, 18.0)
OWN_FLESH_MM: tuple[float, ...] = (_WRIST_MM, *_THUMB_MM, *(_FINGER_MM * 4))
"""How thick the flesh is at each keypoint: a large male hand's thickness there, plus a tenth; of
the wrist a third more, so that it still shows over the heel of a hand that leans 30 degrees."""


@dataclass(frozen=True)
class Sight:
    """How one keypoint is seen; see hi5_common.domain.labels.Keypoint."""

    visibility: KeypointVisibility
    occluder: HandPart | OrnamentName | None
    depth_margin_mm: float | None


def sight_keypoints(
    mesh: ProjectedMesh, occluder: npt.NDArray[np.int32], camera_m: F8, pixels: F8
) -> tuple[Sight, ...]:
    """Return how each keypoint is seen.

    occluder (N,) by vertex (see occluders.py); camera_m (21, 3); pixels (21, 2).
    """
    inside = in_frame(mesh.intrinsics, pixels)
    (left, top), (right, bottom) = (bound.T for bound in mesh.bounds_px)
    sights = []
    for number in range(len(KEYPOINTS)):
        if camera_m[number, 2] <= NEAR_M:
            sights.append(Sight(KeypointVisibility.BEHIND_CAMERA, None, None))
        elif not inside[number]:
            sights.append(Sight(KeypointVisibility.OUT_OF_FRAME, None, None))
        else:
            pixel = pixels[number]
            x, y = pixel
            rows = np.flatnonzero((left <= x) & (right >= x) & (top <= y) & (bottom >= y))
            hit = first_hit(mesh, rows, pixel)
            sights.append(_judged(number, hit, occluder, camera_m[number]))
    return tuple(sights)


@dataclass(frozen=True)
class Hit:
    """The first surface on a line of sight: its depth along the optical axis, nearest vertex."""

    depth_m: float
    vertex: int


def first_hit(mesh: ProjectedMesh, rows: I8, pixel: F8) -> Hit | None:
    """Return where the ray through `pixel` (2,) first meets triangles `rows`, if it does."""
    x, y = np.full(len(rows), pixel[0]), np.full(len(rows), pixel[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = barycentric(mesh, rows, x, y)
    inside = all_of(weights >= 0)
    if not inside.any():
        return None
    rows, weights = rows[inside], weights[inside]
    near = weights / mesh.vertices_camera_m[mesh.triangles[rows], 2]
    first = int(near.sum(axis=1).argmax())
    vertex = int(mesh.triangles[rows[first], int(near[first].argmax())])
    return Hit(1.0 / float(near[first].sum()), vertex)


def _judged(number: int, hit: Hit | None, occluder: npt.NDArray[np.int32], point_m: F8) -> Sight:
    depth_m = float(point_m[2])
    if hit is None or hit.depth_m >= depth_m:
        return Sight(KeypointVisibility.VISIBLE, None, None)
    stretch = float(np.linalg.norm(point_m)) / depth_m
    margin_mm = (depth_m - hit.depth_m) * stretch * 1000.0
    owner = OCCLUDERS[int(occluder[hit.vertex])]
    own = owner in KEYPOINT_PARTS[number] and margin_mm <= OWN_FLESH_MM[number]
    if own:
        return Sight(KeypointVisibility.VISIBLE, None, margin_mm)
    return Sight(KeypointVisibility.SELF_OCCLUDED, owner, margin_mm)
