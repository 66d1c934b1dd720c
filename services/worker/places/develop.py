"""From what was photographed to the finished panorama: air, sky, sun, white balance, bounds."""

import cv2
import numpy as np
import numpy.typing as npt

from services.worker.places.heavens import sphere
from services.worker.places.place import Array

F4 = npt.NDArray[np.float32]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
MAX_RADIANCE = 60_000.0
"""The brightest texel: what fits the half floats of the file."""


def in_the_air(light: F4, cover: F4, far_m: F4, sky: F4, visibility_m: float, full_m: float) -> F4:
    """Return the place before its sky, far things fading into the colour of their horizon.

    light (H, W, 3) premultiplied by cover (H, W); far_m (H, W) is `full_m` where the sky shows.
    Koschmieder's law, one extinction for all colours.
    """
    covered = np.maximum(cover, 1e-4)
    own_m = np.clip((far_m - (1.0 - cover) * full_m) / covered, 0.0, full_m)
    # Mist that is full may be any distance beyond: such a thing is nearly gone.
    through = np.exp(-own_m / visibility_m)[..., None]
    airlight = horizon_colours(sky)[None] * cover[..., None]
    seen = light * through + airlight * (1.0 - through) + sky * (1.0 - cover[..., None])
    return np.asarray(seen, dtype=np.float32)


def horizon_colours(sky: F4) -> F4:
    """Return the colour (W, 3) just above the horizon in every direction, smoothed."""
    height, width = sky.shape[:2]
    low, high = round(0.455 * height), max(round(0.485 * height), round(0.455 * height) + 1)
    band = sky[low:high].mean(axis=0)
    span = max(width // 16, 1)
    wrapped = np.concatenate([band[-span:], band, band[:span]])[None]
    smooth = cv2.blur(wrapped, (span, 1))[0]
    return np.asarray(smooth[span:-span], dtype=np.float32)


def balanced(panorama: F4, share: float, level: float) -> F4:
    """Return the panorama as a camera would record it: `share` 0..1 of its tint taken out.

    Its mean luminance over the sphere becomes `level`; no texel is brighter than MAX_RADIANCE.
    Raises ValueError if a texel is not finite.
    """
    if not np.isfinite(panorama).all():
        raise ValueError("The panorama has texels that are not numbers.")
    picture = np.maximum(panorama.astype(np.float64), 0.0)
    tint = mean_rgb(picture)
    grey = float(tint @ LUMINANCE)
    if grey <= 0.0:
        raise ValueError("The panorama is black.")
    picture *= (grey / np.maximum(tint, 1e-3 * grey)) ** share
    picture *= level / float(mean_rgb(picture) @ LUMINANCE)
    return np.minimum(picture, MAX_RADIANCE).astype(np.float32)


def mean_rgb(panorama: Array | F4) -> Array:
    """Return the mean radiance (3,) over the sphere, each row weighted by its solid angle."""
    rows = panorama.shape[0]
    weight = np.sin((np.arange(rows) + 0.5) * np.pi / rows)
    by_row = panorama.astype(np.float64).mean(axis=1)
    mean: Array = np.einsum("hk,h->k", by_row, weight) / weight.sum()
    return mean


def harmonics(panorama: F4) -> Array:
    """Return the first nine real spherical harmonics (9, 3) of the light, mean luminance one.

    Ramamoorthi and Hanrahan 2001, "An efficient representation for irradiance environment maps".
    """
    directions, texel_sr = sphere(panorama.shape[:2])
    x, y, z = np.moveaxis(directions, -1, 0)
    basis = np.stack(
        [
            np.full_like(x, 0.282095),
            *(0.488603 * y, 0.488603 * z, 0.488603 * x),
            *(1.092548 * x * y, 1.092548 * y * z, 0.315392 * (3 * z * z - 1)),
            *(1.092548 * x * z, 0.546274 * (x * x - y * y)),
        ]
    )
    light = panorama.astype(np.float64) * texel_sr[:, None, None]
    sums: Array = np.einsum("nhw,hwk->nk", basis, light)
    return sums / float(sums[0] @ LUMINANCE)
