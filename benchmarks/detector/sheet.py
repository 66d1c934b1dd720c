"""A picture of the hands that were missed, then of the worst found, both skeletons drawn."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from benchmarks.detector.score import Judged
from hi5_common.domain.vocabulary import SKELETON, Attribute

U1 = npt.NDArray[np.uint8]
Bgr = tuple[int, int, int]
COLUMNS, CELL_PX = 5, 384
OURS_BGR: Bgr = (80, 220, 80)
THEIRS_BGR: Bgr = (60, 60, 240)
CAPTION_BGR: Bgr = (0, 255, 255)


def write_sheet(path: Path, images: Sequence[Judged], most: int = 60) -> None:
    """Draw up to `most` images: all misses in order, then the found by falling error, as a PNG.

    The label's skeleton is green, the detector's red. A miss is drawn bare, the better to see it.
    """
    missed = [image for image in images if not image.is_found]
    found = sorted((i for i in images if i.is_found), key=lambda i: -float(i.errors.mean()))
    cells = [_cell(image) for image in (missed + found)[:most]]
    blank = np.zeros((CELL_PX, CELL_PX, 3), np.uint8)
    cells += [blank] * (-len(cells) % COLUMNS)
    rows = [np.hstack(cells[start : start + COLUMNS]) for start in range(0, len(cells), COLUMNS)]
    cv2.imwrite(str(path), np.vstack(rows or [blank]))


def _cell(image: Judged) -> U1:
    picture = cv2.imread(str(image.picture))
    if picture is None:
        raise SystemExit(f"{image.label.file_name} is not a picture that OpenCV can read.")
    cell = cv2.resize(picture, (CELL_PX, CELL_PX), interpolation=cv2.INTER_AREA).astype(np.uint8)
    scale = CELL_PX / picture.shape[1]
    attributes = image.label.attributes
    caption = f"{image.label.index} {attributes[Attribute.POSE]} {attributes[Attribute.SKIN_TONE]}"
    if image.finding is not None:
        if image.label.keypoints is not None:
            ours = [point.image_px or (0.0, 0.0) for point in image.label.keypoints]
            _skeleton(cell, ours, scale, OURS_BGR)
        _skeleton(cell, image.finding.points_px, scale, THEIRS_BGR)
        caption += f" {image.errors.mean():.1%}"
    cv2.putText(cell, caption, (6, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, CAPTION_BGR, 1, cv2.LINE_AA)
    return cell


def _skeleton(
    picture: U1, points: Sequence[tuple[float, float]], scale: float, colour: Bgr
) -> None:
    places = [(round(x * scale), round(y * scale)) for x, y in points]
    for first, second in SKELETON:
        cv2.line(picture, places[first], places[second], colour, 1, cv2.LINE_AA)
