"""Tight boxes of what the projected mesh shows inside the frame."""

import numpy as np
import numpy.typing as npt

from hi5_common.domain.labels import Box
from services.worker.label.projected import ProjectedMesh, all_of
from services.worker.label.projection import F8


def tight_box(mesh: ProjectedMesh, of_vertex: npt.NDArray[np.bool_]) -> Box | None:
    """Return the box around the in-frame part of the triangles whose corners are all `of_vertex`.

    Edges are cut at the frame, so a hand that leaves the picture gets a box that ends there.
    None if nothing of it is in the frame. of_vertex: (W,).
    """
    size = np.array([mesh.intrinsics.width_px, mesh.intrinsics.height_px], dtype=np.float64)
    pixels = mesh.vertices_px
    inside = all_of((pixels >= 0) & (pixels <= size))
    triangles = mesh.triangles[all_of(of_vertex[mesh.triangles])]
    held = np.zeros(len(pixels), dtype=np.bool_)
    held[triangles.ravel()] = True
    leaving = pixels[triangles[~all_of(inside[triangles])]]
    points = np.concatenate([pixels[held & inside], _clipped(_sides(leaving), size)])
    if not len(points):
        return None
    left, top = points.min(axis=0).tolist()
    right, bottom = points.max(axis=0).tolist()
    return Box(x_px=left, y_px=top, width_px=right - left, height_px=bottom - top)


def _sides(corners: F8) -> F8:
    """Return the (3 T, 2, 2) edges of triangles (T, 3, 2)."""
    sides: F8 = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    return sides


def _clipped(segments: F8, size: F8) -> F8:
    """Return the (N, 2) end points of (E, 2, 2) segments cut to 0..size (Liang and Barsky 1984)."""
    start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        towards_low, towards_high = -start / way, (size - start) / way
    still = way == 0
    inside = (start >= 0) & (start <= size)
    enter = np.where(
        still, np.where(inside, -np.inf, np.inf), np.minimum(towards_low, towards_high)
    )
    leave = np.where(
        still, np.where(inside, np.inf, -np.inf), np.maximum(towards_low, towards_high)
    )
    first = np.maximum(enter.max(axis=1), 0.0)
    last = np.minimum(leave.min(axis=1), 1.0)
    cut = first <= last
    begin = start[cut] + first[cut, None] * way[cut]
    end = start[cut] + last[cut, None] * way[cut]
    ends: F8 = np.clip(np.concatenate([begin, end]), 0.0, size)
    return ends
