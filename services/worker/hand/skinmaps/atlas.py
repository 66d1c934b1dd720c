"""The hand's texture atlas: where its surface lies in the unit square, and what lies in a texel.

The asset's texture coordinates hold a whole body; the hand fills a fifth of their side. Two windows
of them, hand and forearm, are enlarged to fill a square of their own, by one affine map each, so
every subdivision and every shape of the mesh agrees, and so do both genders.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8, I4
from services.worker.hand.model import F4
from services.worker.hand.surface import triangles

FOREARM_ABOVE_V = 0.5
"""The asset keeps forearms in the upper half of its square and hands in the lower."""
HAND_WINDOW = (0.3600, 0.0100, 0.1960)
"""Corner (u, v) and side of the window around the right hand."""
FOREARM_WINDOW = (0.0060, 0.7660, 0.1120)
FOREARM_CORNER, FOREARM_SIDE = (0.640, 0.655), 0.335
"""Where the forearm's window goes: the corner that the hand leaves free."""
SUBTEXEL_BITS = 4
FLAT_PX = 1e-3
"""Faces of less area in the atlas (the cut end of the forearm) count as none."""
OUTSIDE = -1


def atlas_uvs(uvs: F4) -> F4:
    """Texture coordinates (..., 2) of the asset's hand or forearm in the atlas, inside 0..1."""
    u, v = uvs[..., 0], uvs[..., 1]
    placed = []
    for (left, low, side), (corner_u, corner_v), extent in (
        (HAND_WINDOW, (0.0, 0.0), 1.0),
        (FOREARM_WINDOW, FOREARM_CORNER, FOREARM_SIDE),
    ):
        across = corner_u + extent * np.clip((u - left) / side, 0.0, 1.0)
        up = corner_v + extent * np.clip((v - low) / side, 0.0, 1.0)
        placed.append(np.stack([across, up], axis=-1))
    chosen: F4 = np.where(uvs[..., 1:] > FOREARM_ABOVE_V, placed[1], placed[0]).astype(np.float32)
    return chosen


@dataclass(frozen=True, eq=False)
class Texels:
    """The texels of a square picture that a surface covers.

    pixels (T,) row-major index; corners (T, 3) the vertices of the triangle under each texel's
    centre; weights (T, 3) their barycentric weights; nearest (side, side) for every pixel of the
    picture the position in `pixels` of the covered texel nearest to it; area_m2 (T,) surface.
    """

    side_px: int
    pixels: npt.NDArray[np.int64]
    corners: I4
    weights: F8
    nearest: npt.NDArray[np.int64]
    area_m2: F8

    @property
    def count(self) -> int:
        return len(self.pixels)

    def sampled(self, values: F8) -> F8:
        """Values at texels (T, ...) of values at vertices (W, ...)."""
        weights = self.weights.reshape(*self.weights.shape, *(1,) * (values.ndim - 1))
        return np.asarray((values[self.corners] * weights).sum(axis=1), dtype=np.float64)


def rasterised(vertices_m: F8, quads: I4, uvs: F4, side_px: int) -> Texels:
    """Find the triangle under each texel's centre: quads (G, 4), atlas uvs (G, 4, 2)."""
    faces = triangles(quads)
    corners_px = np.concatenate([uvs[:, [0, 1, 2]], uvs[:, [0, 2, 3]]]).astype(np.float64)
    corners_px *= side_px
    # Row 0 of the picture is v = 0 here; files are flipped where they are written.
    owner = np.full((side_px, side_px), OUTSIDE, dtype=np.int32)
    fixed = np.ascontiguousarray(
        np.round((corners_px - 0.5) * 2**SUBTEXEL_BITS).astype(np.int32)[:, :, None]
    )
    for row, corners in enumerate(fixed):
        cv2.fillConvexPoly(owner, corners, float(row), lineType=cv2.LINE_8, shift=SUBTEXEL_BITS)
    pixels = np.flatnonzero(owner.ravel() != OUTSIDE)
    face = owner.ravel()[pixels]
    weights = _barycentric(corners_px[face], pixels, side_px)
    edges_m = vertices_m[faces]
    areas_m2 = np.linalg.norm(
        np.cross(edges_m[:, 1] - edges_m[:, 0], edges_m[:, 2] - edges_m[:, 0]), axis=1
    )
    first, second = (corners_px[:, k] - corners_px[:, 0] for k in (1, 2))
    areas_px = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    # By density, not by count: small faces may have no texel, and their neighbours stand for them.
    area_m2 = np.where(areas_px > FLAT_PX, areas_m2 / np.maximum(areas_px, FLAT_PX), 0.0)[face]
    return Texels(side_px, pixels, faces[face], weights, _nearest(owner, pixels), area_m2)


def _barycentric(corners: F8, pixels: npt.NDArray[np.int64], side_px: int) -> F8:
    """Weights (T, 3), held inside the triangle."""
    point = np.stack([pixels % side_px, pixels // side_px], axis=1) + 0.5
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, ac, ap = b - a, c - a, point - a
    det = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    safe = np.where(np.abs(det) < 1e-12, 1.0, det)
    second = (ap[:, 0] * ac[:, 1] - ap[:, 1] * ac[:, 0]) / safe
    third = (ab[:, 0] * ap[:, 1] - ab[:, 1] * ap[:, 0]) / safe
    weights = np.clip(np.stack([1.0 - second - third, second, third], axis=1), 0.0, 1.0)
    held: F8 = weights / weights.sum(axis=1, keepdims=True)
    return held


def _nearest(owner: npt.NDArray[np.int32], pixels: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    empty = (owner == OUTSIDE).astype(np.uint8)
    _, labels = cv2.distanceTransformWithLabels(
        empty, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    # Labels number the covered pixels, but in OpenCV's own order: read it off those pixels.
    order = np.zeros(len(pixels) + 1, dtype=np.int64)
    order[labels.ravel()[pixels]] = np.arange(len(pixels))
    return order[labels]
