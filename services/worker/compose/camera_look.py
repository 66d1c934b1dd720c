"""What the camera does to the light of hand and background together: blur, noise, tone."""

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.scene.camera_look import CameraLook

F4 = npt.NDArray[np.float32]

REFERENCE_SIDE_PX = 640
BRIGHTEST = 16.0
"""Four stops over white: what a lens still spreads. A sun in the panorama is a thousand times that
and its blur would be a white disc."""
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


def photographed(light: F4, look: CameraLook) -> F4:
    """Return exposed light (H, W, 3), white = 1, as sensor and tone curve give it, 0..1."""
    side_px = min(light.shape[:2])
    sigma_px = look.softness * side_px / REFERENCE_SIDE_PX
    light = np.minimum(light, np.float32(BRIGHTEST))
    if sigma_px >= FAINTEST_BLUR_PX:
        light = _blurred(light, sigma_px)
    return shoulder(noisy(light, look))


def noisy(light: F4, look: CameraLook) -> F4:
    """Return light with the noise of a sensor: variance shot_noise · light + read_noise."""
    if look.shot_noise == 0.0 and look.read_noise == 0.0:
        return light
    # SFC64: three times as fast as the counter-based generators, and its seed is one of those's.
    rng = np.random.Generator(np.random.SFC64(look.noise_seed))
    grain = rng.standard_normal(light.shape, dtype=np.float32)
    variance = np.float32(look.shot_noise) * np.maximum(light, 0.0) + np.float32(look.read_noise)
    grainy: F4 = light + grain * np.sqrt(variance)
    return grainy


def shoulder(light: F4) -> F4:
    """Return light with its highlights rolled off below 1, itself up to SHOULDER_START = s.

    s + (1 - s) · u / (1 + u) with u = (light - s) / (1 - s): slope 1 at s, twice white gives 0.875.
    """
    start = np.float32(SHOULDER_START)
    over = np.maximum(light - start, 0.0) / (1 - start)
    bent: F4 = np.minimum(light, start) + (1 - start) * over / (1 + over)
    return bent


def _blurred(picture: F4, sigma_px: float) -> F4:
    blurred: F4 = cv2.GaussianBlur(
        picture, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE
    ).astype(np.float32, copy=False)
    return blurred
