"""Labelled sheets of pictures."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

U1 = npt.NDArray[np.uint8]
CAPTION_PX, HEADING_PX, GAP_PX = 18, 34, 4
PAPER, INK = 246, (40, 40, 40)
FONT = cv2.FONT_HERSHEY_DUPLEX
JPEG_QUALITY = 82


def laid_out(heading: str, tiles: Sequence[tuple[str, U1]], columns: int) -> U1:
    """Return a sheet of equally large (H, W, 3) pictures, each with its caption under it."""
    height, width = tiles[0][1].shape[:2]
    rows = -(-len(tiles) // columns)
    step_y, step_x = height + CAPTION_PX + GAP_PX, width + GAP_PX
    shape = (HEADING_PX + rows * step_y, GAP_PX + columns * step_x, 3)
    sheet = np.full(shape, PAPER, dtype=np.uint8)
    _write(sheet, heading, (GAP_PX + 2, 24), 0.7)
    for number, (caption, picture) in enumerate(tiles):
        top = HEADING_PX + (number // columns) * step_y
        left = GAP_PX + (number % columns) * step_x
        sheet[top : top + height, left : left + width] = picture
        _write(sheet, caption, (left + 2, top + height + 13), 0.42)
    return sheet


def save_jpeg(sheet: U1, path: Path) -> None:
    """Write a sheet as a JPEG file. OSError if it cannot be written."""
    options = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
    done, data = cv2.imencode(".jpg", sheet[..., ::-1], options)
    if not done:
        raise ValueError(f"OpenCV could not encode a {sheet.shape} sheet.")
    path.write_bytes(data.tobytes())


def _write(sheet: U1, text: str, where: tuple[int, int], scale: float) -> None:
    cv2.putText(sheet, text, where, FONT, scale, INK, 1, cv2.LINE_AA)
