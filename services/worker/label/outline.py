"""How much of each pixel the mesh covers, worked out instead of sampled.

A path tracer's alpha after two samples is one of three values; a denoiser does not touch it. Here
the pixels along the outline are looked at in SUB x SUB places, weighed with the renderer's own
pixel filter, which costs less than one sample of light.
"""

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.label.projected import I8, ProjectedMesh
from services.worker.label.raster import Surface
from services.worker.label.scan import scan, twice_area
from services.worker.render.rect import PixelRect

F4 = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]

SUB = 4
REACH_PX = 1.5
"""Blackman and Harris's four terms reach so far from a pixel's middle: Blender's filter of 1.5 px
is twice as wide as its name, as tests/render/test_outline.py measures."""
_HARRIS = (0.35875, -0.48829, 0.14128, -0.01168)
_FELT, _CUT = 2, 1
"""How many pixels away from an outline it is felt; within how many a pixel can be cut by it."""


def coverage(surface: Surface, region: PixelRect) -> F4 | None:
    """Return the share (h, w) 0..1 of each pixel of a region that the surface covers.

    None if some of the mesh lies before or at the lens: what is left of it is not all that is seen.
    """
    if not surface.mesh.whole:
        return None
    around = region.grown(_FELT)
    inside = _cut(surface.covered, around)
    cut = _mixed(inside, _CUT)
    fine = _finely_covered(surface, around, cut)
    kept = (slice(_FELT, -_FELT),) * 2
    share = inside[kept].astype(np.float32)
    rows, columns = np.nonzero(_mixed(inside, _FELT)[kept])
    steps = np.arange(-SUB, 2 * SUB)
    places = [(at[:, None] + _FELT) * SUB + steps for at in (rows, columns)]
    y, x = places[0][:, :, None], places[1][:, None, :]
    pixels = (y // SUB, x // SUB)
    seen = np.where(cut[pixels], fine[y, x], inside[pixels]).astype(np.float32)
    taps = filter_taps()
    share[rows, columns] = np.clip((seen @ taps) @ taps, 0.0, 1.0)
    return share


def _cut(mask: Mask, rect: PixelRect) -> Mask:
    """Return a rectangle of a mask, which may reach a little beyond it."""
    grown = np.pad(mask, _FELT)
    part: Mask = grown[
        rect.top + _FELT : rect.bottom + _FELT, rect.left + _FELT : rect.right + _FELT
    ]
    return part


def _mixed(inside: Mask, reach_px: int) -> Mask:
    """Return the pixels that have covered pixels and empty ones at most so far away."""
    ones = inside.astype(np.uint8)
    block = np.ones((2 * reach_px + 1, 2 * reach_px + 1), np.uint8)
    border = cv2.BORDER_REPLICATE
    grown = cv2.dilate(ones, block, borderType=border)
    shrunk = cv2.erode(ones, block, borderType=border)
    mixed: Mask = grown != shrunk
    return mixed


def _finely_covered(surface: Surface, rect: PixelRect, cut: Mask) -> Mask:
    """Return which of SUB x SUB places of every pixel of a rectangle triangles on `cut` cover."""
    corner = np.array([rect.left, rect.top])
    height, width = cut.shape
    near = _touching(surface.mesh, corner, cut)
    corners = (surface.mesh.corners_px[near] - corner) * SUB
    fine = np.zeros(height * SUB * width * SUB, dtype=np.bool_)
    for hits in scan(corners[twice_area(corners) < 0], width * SUB, height * SUB):
        fine[hits.pixel] = True
    return fine.reshape(height * SUB, width * SUB)


def _touching(mesh: ProjectedMesh, corner: npt.NDArray[np.int_], cut: Mask) -> I8:
    """Return the triangles whose boxes hold a part of a pixel of `cut`, which has its corner there.

    Their rows.
    """
    summed = cv2.integral(cut.astype(np.uint8))
    height, width = cut.shape
    least, most = mesh.bounds_px
    x0, x1 = (
        np.clip(np.floor(edge[:, 0]) - corner[0] + more, 0, width).astype(np.intp)
        for edge, more in ((least, 0), (most, 1))
    )
    y0, y1 = (
        np.clip(np.floor(edge[:, 1]) - corner[1] + more, 0, height).astype(np.intp)
        for edge, more in ((least, 0), (most, 1))
    )
    held: I8 = np.flatnonzero(summed[y1, x1] - summed[y0, x1] - summed[y1, x0] + summed[y0, x0])
    return held


def filter_taps() -> F4:
    """Return the filter's weights (3 SUB,) at the places along an axis; their sum is 1."""
    places = (np.arange(-SUB, 2 * SUB) + 0.5) / SUB - 0.5
    angle = np.pi * (places / REACH_PX + 1.0)
    weights = sum(term * np.cos(order * angle) for order, term in enumerate(_HARRIS))
    return np.asarray(weights / np.sum(weights), dtype=np.float32)
