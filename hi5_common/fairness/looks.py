"""What the pixels of one delivered image say: apparent skin colour, and a hash of its look.

The apparent typology angle is that of the median colour inside the hand's mask, without its
darkest and brightest tenth, of the picture as it was delivered: light, exposure and white balance
are in it, as they are in what a model sees.
"""

import hashlib
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
import numpy.typing as npt

from hi5_common.domain.errors import PermanentError
from hi5_common.domain.labels import ImageLabel, Mask
from hi5_common.fairness.masks import decode_mask

TRIMMED = (10.0, 90.0)
"""Percentiles of lightness between which a hand's colour is taken."""
FEWEST_PIXELS = 25
"""Of a hand; with fewer its colour is not told."""


@dataclass(frozen=True)
class Look:
    """One image: L*, b* (NaN without a hand), perceptual hash of 64 bits, SHA-256 of its bytes."""

    lightness: float
    yellow: float
    hash64: int
    sha256: bytes


def need_pixels() -> None:
    """Raise PermanentError if pictures cannot be read here."""
    if find_spec("cv2") is None:
        remedy = "install hi5 with its extra `worker`, or audit without pixels (--no-pixels)."
        raise PermanentError(f"pictures cannot be read without OpenCV: {remedy}")


def look_at(content: bytes, label: ImageLabel) -> Look:
    """Read an encoded picture. Raises ValueError if it is none, or not of the label's size."""
    import cv2

    encoded = np.frombuffer(content, np.uint8)
    picture: Any = cv2.imdecode(encoded, cv2.IMREAD_COLOR) if content else None
    if picture is None:
        raise ValueError(f"{label.file_name} is no picture")
    if picture.shape[:2] != (label.height_px, label.width_px):
        raise ValueError(f"{label.file_name} is not of its label's size")
    lightness, yellow = _colour(picture, label.hand_mask or label.mask)
    digits = cv2.img_hash.pHash(picture).tobytes()
    return Look(lightness, yellow, int.from_bytes(digits), hashlib.sha256(content).digest())


def _colour(picture: npt.NDArray[np.uint8], mask: Mask | None) -> tuple[float, float]:
    """Return the median L* and b* (D65) of a hand's pixels in an 8-bit sRGB picture, BGR."""
    import cv2

    if mask is None:
        return np.nan, np.nan
    pixels = picture[decode_mask(mask)]
    if len(pixels) < FEWEST_PIXELS:
        return np.nan, np.nan
    bgr = pixels[None].astype(np.float32) / np.float32(255.0)
    lab: Any = cv2.cvtColor(bgr, cv2.COLOR_BGR2Lab)[0]
    low, high = np.percentile(lab[:, 0], TRIMMED)
    kept = lab[(lab[:, 0] >= low) & (lab[:, 0] <= high)]
    lightness, _, yellow = np.median(kept, axis=0).tolist()
    return lightness, yellow
