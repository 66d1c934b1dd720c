"""The pixels a hand can touch: the only ones that are path traced."""

import numpy as np

from services.worker.label.projected import ProjectedMesh
from services.worker.render.rect import PixelRect

FILTER_MARGIN_PX = 2
"""The pixel filter reaches 1.5 px from a pixel's middle, a pixel's own half among them; half a
pixel more for float32.

Subsurface scattering needs no margin: light wanders inside the flesh, and leaves it on the flesh.
"""
MIN_SIDE_PX = 4
"""Blender's smallest picture."""


def touched_region(mesh: ProjectedMesh) -> PixelRect:
    """Return the rectangle, inside the frame, of every pixel the mesh can touch; may be empty."""
    width, height = mesh.intrinsics.width_px, mesh.intrinsics.height_px
    if not len(mesh.triangles):
        return PixelRect(0, 0, 0, 0)
    least, most = mesh.bounds_px
    limit = 4.0 * max(width, height)
    left, top = np.floor(np.clip(least.min(axis=0), -limit, limit)).astype(int).tolist()
    right, bottom = np.ceil(np.clip(most.max(axis=0), -limit, limit)).astype(int).tolist()
    rect = PixelRect(left, top, right, bottom).grown(FILTER_MARGIN_PX).clipped(width, height)
    return rect if rect.is_empty else _at_least(rect, width, height)


def _at_least(rect: PixelRect, width_px: int, height_px: int) -> PixelRect:
    left, right = _widened(rect.left, rect.right, width_px)
    top, bottom = _widened(rect.top, rect.bottom, height_px)
    return PixelRect(left, top, right, bottom)


def _widened(low: int, high: int, limit: int) -> tuple[int, int]:
    low = max(0, min(low, limit - MIN_SIDE_PX))
    return low, min(max(high, low + MIN_SIDE_PX), limit)
