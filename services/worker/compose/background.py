"""The environment behind the hand, read straight from the panorama instead of path traced.

A panorama has far fewer texels in view than the picture has pixels, so bilinear reading is enough;
where it has more, pixels are averages of several readings.
"""

import math

import numpy as np
import numpy.typing as npt

from services.worker.scene.types import Camera, Intrinsics

F4 = npt.NDArray[np.float32]
F8 = npt.NDArray[np.float64]

MAX_READINGS = 8
"""Readings along each side of a pixel, at most."""
CHUNK = 16_384
"""Pixels read at a time, so that what is computed of them stays in a processor's cache."""


def render_background(
    camera: Camera, panorama: F4, rotation_z_deg: float, wanted: npt.NDArray[np.bool_]
) -> F4:
    """Return the (H, W, 3) f4 linear radiance behind the hand; zero where not `wanted` (H, W)."""
    side = readings_per_side(camera.intrinsics, panorama.shape[1])
    picture = np.zeros((*wanted.shape, 3), dtype=np.float32)
    every_row, every_column = np.nonzero(wanted)
    for start in range(0, len(every_row), CHUNK):
        rows, columns = (places[start : start + CHUNK] for places in (every_row, every_column))
        total = np.zeros((len(rows), 3), dtype=np.float32)
        for dy in range(side):
            for dx in range(side):
                x = columns.astype(np.float64) + (dx + 0.5) / side
                y = rows.astype(np.float64) + (dy + 0.5) / side
                total += _read(panorama, *_texels(camera, x, y, rotation_z_deg, panorama.shape))
        picture[rows, columns] = total / np.float32(side * side)
    return picture


def readings_per_side(intrinsics: Intrinsics, panorama_width_px: int) -> int:
    """Return how many texels a pixel at the centre of the picture is wide, rounded up."""
    texels_per_radian = panorama_width_px / (2.0 * math.pi)
    texels = texels_per_radian / min(intrinsics.fx_px, intrinsics.fy_px)
    return min(max(math.ceil(texels), 1), MAX_READINGS)


def _texels(
    camera: Camera, x_px: F8, y_px: F8, rotation_z_deg: float, shape: tuple[int, ...]
) -> tuple[F8, F8]:
    """Return panorama coordinates, in texels from its outer top-left corner, of pixels (N,).

    Blender's layout: the middle of the picture looks along +x, longitude grows to the left, the
    top row is straight up.
    """
    direction = _directions(camera, x_px, y_px)
    longitude = np.arctan2(direction[:, 1], direction[:, 0]) - math.radians(rotation_z_deg)
    level = np.hypot(direction[:, 0], direction[:, 1])
    latitude = np.arctan2(direction[:, 2], level)
    height, width = shape[:2]
    return (0.5 - longitude / (2.0 * math.pi)) * width, (0.5 - latitude / math.pi) * height


def _directions(camera: Camera, x_px: F8, y_px: F8) -> F8:
    lens = camera.intrinsics
    x, y = (x_px - lens.cx_px) / lens.fx_px, (y_px - lens.cy_px) / lens.fy_px
    rays: F8 = np.stack([x, y, np.ones_like(x)], axis=-1) @ camera.world_to_camera[:3, :3]
    return rays


def _read(panorama: F4, u: F8, v: F8) -> F4:
    """Return the bilinear (N, 3) values at texel coordinates; wraps around, ends at the poles."""
    height, width = panorama.shape[:2]
    left, top = np.floor(u - 0.5), np.floor(v - 0.5)
    across = (u - 0.5 - left).astype(np.float32)[:, None]
    down = (v - 0.5 - top).astype(np.float32)[:, None]
    x0, y0 = left.astype(np.intp), top.astype(np.intp)
    x0, x1 = x0 % width, (x0 + 1) % width
    y0, y1 = np.clip(y0, 0, height - 1), np.clip(y0 + 1, 0, height - 1)
    upper = panorama[y0, x0] * (1 - across) + panorama[y0, x1] * across
    lower = panorama[y1, x0] * (1 - across) + panorama[y1, x1] * across
    mixed: F4 = upper * (1 - down) + lower * down
    return mixed
