"""Where the errors lie: hands beside their references, enlarged, with their FLIP maps."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.bench.errors import F4, Halves, crop_box, displayed, flip_map

MAPS = "maps.jpg"
TILE_PX = 192
INSET_PX = 64
"""How many pixels of the picture an inset enlarges to a tile."""
HEAD_PX = 22
JPEG_QUALITY = 88

U1 = npt.NDArray[np.uint8]


def write_maps(
    path: Path, halves: Mapping[int, Halves], frames: Mapping[str, dict[int, F4]]
) -> None:
    """Write a sheet: a row for each scene of `halves`; frames: pictures by way, then by scene.

    A row is the reference and, where the last way errs most, its inset; then for each way the same
    inset and the FLIP map of the whole hand (magma; black is no error).
    """
    names = list(frames)
    heads = ["reference", "enlarged", *(f"{name}{of}" for name in names for of in ("", ": FLIP"))]
    rows = [_heads(heads)]
    for index, both in halves.items():
        rows.append(_row(both, [frames[name][index] for name in names]))
    sheet = cv2.cvtColor(np.concatenate(rows), cv2.COLOR_RGB2BGR)
    path.write_bytes(cv2.imencode(".jpg", sheet, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1])


def _row(both: Halves, pictures: Sequence[F4]) -> U1:
    reference = displayed(both.mean)
    maps = [flip_map(displayed(picture), reference) * both.mask for picture in pictures]
    box = crop_box(both.mask)
    corner = _worst_corner(maps[-1])
    tiles = [_tile(_cut(reference, box)), _inset(reference, corner)]
    for picture, found in zip(pictures, maps, strict=True):
        tiles += [_inset(displayed(picture), corner), _magma(_cut(found, box))]
    return np.concatenate(tiles, axis=1)


def _worst_corner(found: F4) -> tuple[int, int]:
    """Return the row and column where the square of INSET_PX with most error begins."""
    sums = cv2.boxFilter(found, -1, (INSET_PX, INSET_PX), anchor=(0, 0), normalize=False)
    height, width = found.shape
    inside = sums[: max(height - INSET_PX, 1), : max(width - INSET_PX, 1)]
    row, column = np.unravel_index(int(inside.argmax()), inside.shape)
    return int(row), int(column)


def _cut(picture: F4, box: tuple[int, int, int]) -> F4:
    """Return the square `box` (left, top, side) of a picture, edges repeated beyond it."""
    left, top, side = box
    rows = np.clip(np.arange(top, top + side), 0, picture.shape[0] - 1)
    columns = np.clip(np.arange(left, left + side), 0, picture.shape[1] - 1)
    return np.ascontiguousarray(picture[rows][:, columns])


def _inset(picture: F4, corner: tuple[int, int]) -> U1:
    row, column = corner
    part = picture[row : row + INSET_PX, column : column + INSET_PX]
    return _tile(np.ascontiguousarray(part), cv2.INTER_NEAREST)


def _tile(picture: F4, way: int = cv2.INTER_AREA) -> U1:
    shown: F4 = np.clip(cv2.resize(picture, (TILE_PX, TILE_PX), interpolation=way), 0.0, 1.0)
    tile: U1 = np.rint(shown * 255.0).astype(np.uint8)
    return tile


def _magma(found: F4) -> U1:
    small = cv2.resize(found, (TILE_PX, TILE_PX), interpolation=cv2.INTER_AREA)
    levels = np.rint(np.clip(small, 0.0, 1.0) * 255.0).astype(np.uint8)
    coloured: U1 = np.array(cv2.applyColorMap(levels, cv2.COLORMAP_MAGMA)[..., ::-1], np.uint8)
    return coloured


def _heads(words: Sequence[str]) -> U1:
    strip = np.full((HEAD_PX, TILE_PX * len(words), 3), 255, np.uint8)
    for column, word in enumerate(words):
        place = (column * TILE_PX + 6, HEAD_PX - 7)
        cv2.putText(strip, word, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
    return strip
