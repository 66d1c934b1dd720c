"""What the camera does to the light of hand and background together: blur, noise, tone."""

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.scene.camera_look import CameraLook

F4 = npt.NDArray[np.float32]

REFERENCE_SIDE_PX = 640
BRIGHTEST = 16.0
"""Four stops over white: where light ends; beyond it the shoulder is flat to a level of 8 bits."""
BACKGROUND_M = 3.0
"""How far away the background is taken to be: panoramas do not say."""
SHOULDER_START = 0.5
"""Linear light, 0.735 in sRGB: all below keeps the standard curve, so that colours of skin do."""
FAINTEST_BLUR_PX = 0.1


def out_of_focus(
    background: F4,
    seen: npt.NDArray[np.bool_],
    look: CameraLook,
    focal_px: float,
    distance_m: float,
) -> F4:
    """Return the (H, W, 3) background blurred as far behind what is in focus at `distance_m`.

    The thin lens's circle of confusion, as a Gaussian of the same variance. Only `seen` (H, W)
    pixels are mixed: what the hand hides does not bleed over its edge.
    """
    nearness = max(1.0 / distance_m - 1.0 / BACKGROUND_M, 0.0)
    diameter_px = look.aperture_mm * 1e-3 * focal_px * nearness
    sigma_px = diameter_px / 4.0
    if sigma_px < FAINTEST_BLUR_PX:
        return background
    weight = seen.astype(np.float32)
    light = _blurred(background * weight[..., None], sigma_px)
    share = np.maximum(_blurred(weight, sigma_px), np.float32(1e-6))
    mixed: F4 = np.divide(light, share[..., None], dtype=np.float32)
    return mixed


def softened(bent: F4, look: CameraLook) -> F4:
    """Return light (H, W, 3) bent by `shoulder` as the lens blurs it.

    Bent light, so that an outline is as soft before a window as before a wall; the blur of light
    itself eats as much of the hand as the window is bright.
    """
    sigma_px = look.softness * min(bent.shape[:2]) / REFERENCE_SIDE_PX
    return bent if sigma_px < FAINTEST_BLUR_PX else _blurred(bent, sigma_px)


class Noise:
    """The noise of a sensor, from the first pixel of a picture to the last."""

    def __init__(self, look: CameraLook) -> None:
        self._look = look
        # SFC64: three times as fast as counter-based generators, and its seed is one of those's.
        self._rng = np.random.Generator(np.random.SFC64(look.noise_seed))

    @property
    def _silent(self) -> bool:
        return self._look.shot_noise == 0.0 and self._look.read_noise == 0.0

    def on_bent(self, bent: F4) -> F4:
        """Return the next rows (n, W, 3) of light bent by `shoulder`, with their noise, 0..1."""
        return bent if self._silent else shoulder(self.on(straightened(bent)))

    def on(self, light: F4) -> F4:
        """Return the next rows with their noise: variance shot_noise · light + read_noise."""
        if self._silent:
            return light
        look = self._look
        grain = self._rng.standard_normal(light.shape, dtype=np.float32)
        variance = np.float32(look.shot_noise) * np.maximum(light, 0.0)
        variance += np.float32(look.read_noise)
        grain *= np.sqrt(variance)
        grain += light
        return grain


def shoulder(light: F4) -> F4:
    """Return exposed light, white = 1, with its highlights rolled off, itself up to s = 0.5.

    s + (1 - s) · u / (1 + u) with u = (light - s) / (1 - s), slope 1 at s, twice white gives 0.875;
    light beyond BRIGHTEST is BRIGHTEST.
    """
    start = np.float32(SHOULDER_START)
    over = np.maximum(np.minimum(light, np.float32(BRIGHTEST)) - start, 0.0) / (1 - start)
    return np.add(np.minimum(light, start), (1 - start) * over / (1 + over), dtype=np.float32)


def straightened(bent: F4) -> F4:
    """Return the light that `shoulder` bends to this."""
    start = np.float32(SHOULDER_START)
    share = np.maximum(bent - start, 0.0) / (1 - start)
    light: F4 = np.add(np.minimum(bent, start), (1 - start) * share / (1 - share), dtype=np.float32)
    return light


def _blurred(picture: F4, sigma_px: float) -> F4:
    blurred: F4 = cv2.GaussianBlur(
        picture, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE
    ).astype(np.float32, copy=False)
    return blurred
