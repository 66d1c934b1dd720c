"""How far a picture of a hand is from the converged one, with the reference's own noise taken out.

The reference comes as two halves rendered with seeds of their own. Their errors are independent,
so the product of the differences to either half has the squared error as its mean, without the
halves' noise: no noise has to be estimated and subtracted. FLIP knows no such thing, and is given
beside what it says of one half against the other.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.compose.picture import srgb_curve

F4 = npt.NDArray[np.float32]
F8 = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

REL_EPSILON = 0.01
"""Keeps relMSE finite in the dark: (x - r)^2 / (r^2 + 0.01) of exposed linear light."""
GROUND = 0.5
"""What lies under the hand's outline, in display values: the same for both pictures."""
CROP_PX = 256
CROP_MARGIN = 1.25
"""A trainer's crop: the hand's box, this much wider, square."""
WHOLE = 0.5
"""Coverage from which a pixel counts as the hand's."""
BEST_DB = 99.0
"""What two equal pictures are given: their error is below the noise that can be told."""


@dataclass(frozen=True)
class Errors:
    """Errors inside the hand. psnr_db and crop_psnr_db in display space, white 1; relmse of light.

    flip is the mean FLIP (LDR, 67 pixels a degree), floor_flip that between the reference's halves.
    """

    psnr_db: float
    crop_psnr_db: float
    relmse: float
    flip: float
    floor_flip: float


@dataclass(frozen=True, eq=False)
class Halves:
    """A reference: two independent pictures (H, W, 4) f4, premultiplied linear light, exposed."""

    first: F4
    second: F4

    @property
    def mean(self) -> F4:
        """Return the better picture that they make together."""
        both: F4 = (self.first + self.second) * np.float32(0.5)
        return both

    @property
    def mask(self) -> Mask:
        """Return which pixels (H, W) are the hand's."""
        hand: Mask = self.mean[..., 3] > WHOLE
        return hand


def errors_of(picture: F4, halves: Halves) -> Errors:
    """Compare a picture (H, W, 4), premultiplied linear light, exposed, with a reference."""
    mask = halves.mask
    shown, first, second = (displayed(p) for p in (picture, halves.first, halves.second))
    box = crop_box(mask)
    small, small_first, small_second = (cropped_to(p, box) for p in (shown, first, second))
    inner = crop_mask(mask, box)
    return Errors(
        psnr_db=psnr_db(_mse(shown, first, second, mask)),
        crop_psnr_db=psnr_db(_mse(small, small_first, small_second, inner)),
        relmse=_relmse(picture, halves, mask),
        flip=flip(shown, displayed(halves.mean), mask),
        floor_flip=flip(first, second, mask),
    )


def displayed(rgba: F4) -> F4:
    """Return display values (H, W, 3) of premultiplied linear light over an even ground."""
    alpha = np.clip(rgba[..., 3:], 0.0, 1.0)
    light: F4 = np.divide(rgba[..., :3], np.maximum(alpha, 1e-6), dtype=np.float32)
    shown: F4 = srgb_curve(light) * alpha + np.float32(GROUND) * (1.0 - alpha)
    return shown


def psnr_db(mse: float) -> float:
    """Return the peak signal-to-noise ratio of a mean squared error, white being 1."""
    return min(-10.0 * math.log10(mse), BEST_DB) if mse > 0.0 else BEST_DB


def crop_box(mask: Mask) -> tuple[int, int, int]:
    """Return left, top and side in pixels of the square crop that a trainer would take."""
    rows, columns = np.nonzero(mask)
    middle = ((columns.min() + columns.max() + 1) / 2.0, (rows.min() + rows.max() + 1) / 2.0)
    side = max(float(np.ptp(columns)), float(np.ptp(rows))) + 1.0
    side_px = max(math.ceil(CROP_MARGIN * side), 8)
    return round(middle[0] - side_px / 2.0), round(middle[1] - side_px / 2.0), side_px


def cropped_to(picture: F4, box: tuple[int, int, int]) -> F4:
    """Return the crop at CROP_PX a side, edges repeated beyond the picture."""
    left, top, side = box
    height, width = picture.shape[:2]
    rows = np.clip(np.arange(top, top + side), 0, height - 1)
    columns = np.clip(np.arange(left, left + side), 0, width - 1)
    part = np.ascontiguousarray(picture[rows][:, columns])
    way = cv2.INTER_AREA if side >= CROP_PX else cv2.INTER_LINEAR
    return cv2.resize(part, (CROP_PX, CROP_PX), interpolation=way).astype(np.float32, copy=False)


def crop_mask(mask: Mask, box: tuple[int, int, int]) -> Mask:
    """Return which pixels of the crop are the hand's; what repeats an edge is not."""
    left, top, side = box
    around = np.pad(mask.astype(np.float32), side)
    part = around[side + top : 2 * side + top, side + left : 2 * side + left]
    way = cv2.INTER_AREA if side >= CROP_PX else cv2.INTER_LINEAR
    inner: Mask = cv2.resize(part, (CROP_PX, CROP_PX), interpolation=way) > WHOLE
    return inner


def flip(shown: F4, reference: F4, mask: Mask) -> float:
    """Return the mean of the FLIP map (Andersson et al. 2020) over the mask."""
    return float(flip_map(shown, reference)[mask].mean())


def flip_map(shown: F4, reference: F4) -> F4:
    """Return the FLIP map (H, W) of two pictures in display values."""
    import flip_evaluator

    ready = [np.ascontiguousarray(np.clip(p, 0.0, 1.0), np.float32) for p in (reference, shown)]
    found, _, _ = flip_evaluator.evaluate(*ready, "LDR", applyMagma=False)
    values: F4 = np.asarray(found, np.float32).reshape(shown.shape[:2])
    return values


def _mse(shown: F4, first: F4, second: F4, mask: Mask) -> float:
    apart = (shown - first)[mask].astype(np.float64) * (shown - second)[mask]
    return float(apart.mean())


def _relmse(picture: F4, halves: Halves, mask: Mask) -> float:
    light, first, second = (
        p[..., :3][mask].astype(np.float64) for p in (picture, halves.first, halves.second)
    )
    both = 0.5 * (first + second)
    return float(((light - first) * (light - second) / (both**2 + REL_EPSILON)).mean())
