"""The environment behind the hand, read straight from the panorama instead of path traced.

A panorama has far fewer texels in view than the picture has pixels, so bilinear reading is enough;
where it has more, pixels are averages of several readings.

Where a pixel looks on the panorama is a smooth function of where it lies, so that it is worked out
at a few places of every tile and interpolated: within EXACT_TEXELS, or it is worked out everywhere.
"""

import math
from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.scene.types import Camera, Intrinsics

F4 = npt.NDArray[np.float32]
F8 = npt.NDArray[np.float64]

MAX_READINGS = 8
"""Readings along each side of a pixel, at most."""
TILE_PX = 32
TILES = 256
"""Tiles read at a time: bounds memory, changes nothing else."""
EXACT_TEXELS = 1e-3
_NODES = 0.5 + 0.5 * np.cos(math.pi * (np.arange(5)[::-1] + 0.5) / 5)
"""Chebyshev's places in a tile, as shares of its side."""
_CHECKED = np.array([0.0, 0.5 * (_NODES[0] + _NODES[1]), 0.5 * (_NODES[1] + _NODES[2]), 1.0])


def render_background(
    camera: Camera, panorama: F4, rotation_z_deg: float, wanted: npt.NDArray[np.bool_]
) -> F4:
    """Return the (H, W, 3) f4 linear radiance behind the hand; zero where not `wanted` (H, W).

    A tile of which any pixel is wanted is read whole; what is not wanted is not looked at.
    """
    side = readings_per_side(camera.intrinsics, panorama.shape[1])
    gaze = _Gaze(camera, rotation_z_deg, panorama.shape[1], panorama.shape[0])
    height, width = wanted.shape
    down, across = -(-height // TILE_PX), -(-width // TILE_PX)
    whole = np.zeros((down * TILE_PX, across * TILE_PX, 3), dtype=np.float32)
    tiled = whole.reshape(down, TILE_PX, across, TILE_PX, 3)
    for rows, columns in _tiles(wanted, down, across):
        corners = np.stack([columns, rows], axis=-1).astype(np.float64) * TILE_PX
        for dy in range(side):
            for dx in range(side):
                texels = gaze.texels(corners, (dx + 0.5) / side, (dy + 0.5) / side)
                tiled[rows, :, columns] += _read(panorama, *texels)
    whole /= np.float32(side * side)
    picture = np.ascontiguousarray(whole[:height, :width])
    picture[~wanted] = 0.0
    return picture


def readings_per_side(intrinsics: Intrinsics, panorama_width_px: int) -> int:
    """Return how many texels a pixel at the centre of the picture is wide, rounded up."""
    texels_per_radian = panorama_width_px / (2.0 * math.pi)
    texels = texels_per_radian / min(intrinsics.fx_px, intrinsics.fy_px)
    return min(max(math.ceil(texels), 1), MAX_READINGS)


def _tiles(
    wanted: npt.NDArray[np.bool_], down: int, across: int
) -> Iterator[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]]:
    """Yield rows and columns, in tiles, of the tiles in which anything is wanted."""
    padded = np.zeros((down * TILE_PX, across * TILE_PX), dtype=np.bool_)
    padded[: wanted.shape[0], : wanted.shape[1]] = wanted
    asked = padded.reshape(down, TILE_PX, across, TILE_PX).any(axis=(1, 3))
    rows, columns = np.nonzero(asked)
    for start in range(0, len(rows), TILES):
        yield rows[start : start + TILES], columns[start : start + TILES]


class _Gaze:
    """Where on the panorama pixels look.

    Blender's layout: the middle of the picture looks along +x, longitude grows to the left, the
    top row is straight up.
    """

    def __init__(self, camera: Camera, rotation_z_deg: float, width: int, height: int) -> None:
        self._lens = camera.intrinsics
        self._to_world = camera.world_to_camera[:3, :3]
        self._turn = math.radians(rotation_z_deg)
        self._size = (width, height)

    def texels(self, corners_px: F8, x: float, y: float) -> tuple[F8, F8]:
        """Return panorama coordinates of the points (x, y) of every pixel of tiles (N, 2).

        In texels from the panorama's outer top-left corner, (N, TILE_PX, TILE_PX) each; across,
        they may lie a panorama's width outside.
        """
        spots = (np.arange(TILE_PX) + x) / TILE_PX, (np.arange(TILE_PX) + y) / TILE_PX
        nodes = self._exactly(corners_px, _NODES, _NODES)
        checked = self._exactly(corners_px, _CHECKED, _CHECKED)
        test = _basis(_CHECKED)
        off = np.zeros(len(corners_px))
        for guessed, known in zip(nodes, checked, strict=True):
            apart = np.abs(test @ guessed @ test.T - known)
            off = np.maximum(off, apart.max(axis=(1, 2)))
        across, down = (_basis(places) for places in spots)
        found = [down @ values @ across.T for values in nodes]
        rough = ~(off <= EXACT_TEXELS)
        if rough.any():
            for values, exact in zip(found, self._exactly(corners_px[rough], *spots), strict=True):
                values[rough] = exact
        return found[0], found[1]

    def _exactly(self, corners_px: F8, x: F8, y: F8) -> tuple[F8, F8]:
        """Return panorama coordinates at shares x (K,), y (L,) of tiles' sides: (N, L, K) each."""
        middle = self._ways(corners_px[:, 0] + TILE_PX / 2.0, corners_px[:, 1] + TILE_PX / 2.0)
        ahead = np.arctan2(middle[1], middle[0])[:, None, None]
        way = self._ways(
            (corners_px[:, 0, None] + x * TILE_PX)[:, None, :],
            (corners_px[:, 1, None] + y * TILE_PX)[:, :, None],
        )
        # Counted from the tile's middle, longitude has no seam in the tile.
        level_x = way[0] * np.cos(ahead) + way[1] * np.sin(ahead)
        level_y = way[1] * np.cos(ahead) - way[0] * np.sin(ahead)
        longitude = np.arctan2(level_y, level_x) + np.mod(ahead - self._turn, 2.0 * math.pi)
        latitude = np.arctan2(way[2], np.hypot(level_x, level_y))
        width, height = self._size
        return (0.5 - longitude / (2.0 * math.pi)) * width, (0.5 - latitude / math.pi) * height

    def _ways(self, x_px: F8, y_px: F8) -> tuple[F8, F8, F8]:
        """Return the world's x, y and z of the directions of points on the picture."""
        lens = self._lens
        x, y = (x_px - lens.cx_px) / lens.fx_px, (y_px - lens.cy_px) / lens.fy_px
        a, b, c = (x * right + y * down + ahead for right, down, ahead in self._to_world.T)
        return a, b, c


def _basis(places: F8) -> F8:
    """Return (K, 5) what each node's value adds to the polynomial at places (K,)."""
    columns = []
    for node in range(len(_NODES)):
        others = np.delete(_NODES, node)
        columns.append(np.prod((places[:, None] - others) / (_NODES[node] - others), axis=1))
    return np.stack(columns, axis=1)


def _read(panorama: F4, u: F8, v: F8) -> F4:
    """Return bilinear values (N, T, T, 3) at texel coordinates: goes round, ends at the poles."""
    height = panorama.shape[0]
    flat = (u.shape[0] * u.shape[1], u.shape[2])
    across = (u - 0.5).astype(np.float32).reshape(flat)
    down = np.clip(v - 0.5, 0.0, height - 1.0).astype(np.float32).reshape(flat)
    light = cv2.remap(panorama, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    mixed: F4 = light.astype(np.float32, copy=False).reshape(*u.shape, 3)
    return mixed
