"""A picture of many images with their labels drawn, for a person to judge at a glance."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.labels import ImageLabel, Keypoint
from hi5_common.domain.values import in_words
from hi5_common.domain.vocabulary import ORNAMENTS, SKELETON, Attribute, KeypointVisibility

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Picture = npt.NDArray[np.uint8]

Bgr = tuple[int, int, int]

WRIST_BGR: Bgr = (255, 255, 255)
FINGER_BGR: tuple[Bgr, ...] = (
    (60, 60, 230),  # thumb: red
    (0, 165, 255),  # forefinger: orange
    (80, 200, 60),  # middle finger: green
    (230, 160, 40),  # ring finger: blue
    (220, 80, 200),  # pinky: violet
)
CAPTION_PX = 40
GAP_PX = 6
_SUBPIXEL_BITS = 4
_PAPER = 250
_INK_BGR: Bgr = (40, 40, 40)


class DrawingUnavailable(PermanentError):
    """OpenCV is not installed, so no pictures can be drawn. Install hi5 with its worker extra."""


class UnreadablePicture(PermanentError):
    """An image file cannot be decoded."""


def write_contact_sheet(
    path: Path,
    images: Iterable[tuple[Path, ImageLabel]],
    *,
    columns: int = 6,
    cell_px: int = 320,
) -> None:
    """Draw the images in rows, with skeleton and caption, and write one PNG.

    A point its own hand hides is hollow; colours tell the fingers apart. Equal images and labels
    give equal bytes. Memory grows with the number of images: choose which to draw before.
    """
    _require_opencv()
    cells = [_cell(_read(file), label, cell_px) for file, label in images]
    _write(path, _sheet(cells, columns))


def draw_keypoints(picture: "Picture", label: ImageLabel) -> None:
    """Draw bones and points onto a (H, W, 3) uint8 BGR picture of any size, in place."""
    points = label.keypoints
    if points is None:
        return
    scale = picture.shape[1] / label.width_px
    for first, second in SKELETON:
        _bone(picture, points[first], points[second], _colour(second), scale)
    for number, point in enumerate(points):
        _dot(picture, point, _colour(number), scale)


def _require_opencv() -> None:
    try:
        import cv2  # noqa: F401
    except ImportError as error:
        raise DrawingUnavailable from error


def _read(file: Path) -> "Picture":
    import cv2

    picture = cv2.imread(str(file), cv2.IMREAD_COLOR)
    if picture is None:
        raise UnreadablePicture(f"{file} is not an image that OpenCV can decode.")
    return picture  # type: ignore[return-value]


def _write(path: Path, sheet: "Picture") -> None:
    import cv2

    _, encoded = cv2.imencode(".png", sheet)
    path.write_bytes(encoded.tobytes())


def _cell(picture: "Picture", label: ImageLabel, cell_px: int) -> "Picture":
    """Return the image scaled to cell_px wide, its labels drawn, its caption below."""
    import cv2

    height_px = round(cell_px * label.height_px / label.width_px)
    shrinks = cell_px < label.width_px
    method = cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    scaled: Picture = cv2.resize(picture, (cell_px, height_px), interpolation=method)  # type: ignore[assignment]
    draw_keypoints(scaled, label)
    return cv2.vconcat([scaled, _caption(label, cell_px)])  # type: ignore[return-value]


def _caption(label: ImageLabel, width_px: int) -> "Picture":
    import cv2
    import numpy as np

    paper = np.full((CAPTION_PX, width_px, 3), _PAPER, np.uint8)
    for row, text in enumerate(caption_lines(label)):
        place = (4, 15 + 17 * row)
        cv2.putText(paper, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.42, _INK_BGR, 1, cv2.LINE_AA)
    return paper


def caption_lines(label: ImageLabel) -> tuple[str, str]:
    """Say what was asked for: index, tone, gender and hand, then pose, viewpoint and ornaments."""
    value = {name: in_words(name, found) for name, found in label.attributes.items()}
    hand = f"{value[Attribute.HANDEDNESS]} hand"
    first = f"{label.index}  {value[Attribute.SKIN_TONE]}, {value[Attribute.GENDER]}, {hand}"
    worn = [
        f"{name.value.replace('_', ' ')} {value[name]}"
        for name in ORNAMENTS
        if value.get(name, "none") != "none"
    ]
    return first, ", ".join([value[Attribute.POSE], value[Attribute.VIEWPOINT], *worn])


def _sheet(cells: Sequence["Picture"], columns: int) -> "Picture":
    import numpy as np

    rows = math.ceil(len(cells) / columns)
    height_px = max(cell.shape[0] for cell in cells) + GAP_PX
    width_px = max(cell.shape[1] for cell in cells) + GAP_PX
    shape = (rows * height_px + GAP_PX, columns * width_px + GAP_PX, 3)
    sheet = np.full(shape, _PAPER, np.uint8)
    for number, cell in enumerate(cells):
        top = GAP_PX + number // columns * height_px
        left = GAP_PX + number % columns * width_px
        sheet[top : top + cell.shape[0], left : left + cell.shape[1]] = cell
    return sheet


def _colour(number: int) -> Bgr:
    return WRIST_BGR if number == 0 else FINGER_BGR[(number - 1) // 4]


def _bone(picture: "Picture", first: Keypoint, second: Keypoint, colour: Bgr, scale: float) -> None:
    import cv2

    if first.image_px is None or second.image_px is None:
        return
    ends = _fixed_point(first.image_px, scale), _fixed_point(second.image_px, scale)
    cv2.line(picture, *ends, colour, 2, cv2.LINE_AA, _SUBPIXEL_BITS)


def _dot(picture: "Picture", point: Keypoint, colour: Bgr, scale: float) -> None:
    import cv2

    if point.image_px is None:
        return
    centre, radius = _fixed_point(point.image_px, scale), 4 << _SUBPIXEL_BITS
    if point.visibility is not KeypointVisibility.VISIBLE:
        cv2.circle(picture, centre, radius, colour, 1, cv2.LINE_AA, _SUBPIXEL_BITS)
        return
    cv2.circle(picture, centre, radius, colour, cv2.FILLED, cv2.LINE_AA, _SUBPIXEL_BITS)
    cv2.circle(picture, centre, radius, _INK_BGR, 1, cv2.LINE_AA, _SUBPIXEL_BITS)


def _fixed_point(image_px: tuple[float, float], scale: float) -> tuple[int, int]:
    """OpenCV counts from the centre of the first pixel, labels from its outer corner."""
    x, y = ((value * scale - 0.5) * (1 << _SUBPIXEL_BITS) for value in image_px)
    return _bounded(x), _bounded(y)


def _bounded(value: float) -> int:
    """Keep far-out points within the integers that OpenCV clips correctly."""
    return round(min(max(value, -(2**24)), 2**24))
