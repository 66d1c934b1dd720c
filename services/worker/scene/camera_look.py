"""The camera that hand and background share: how soft, how noisy, how shallow its focus."""

import math
from dataclasses import dataclass

import numpy as np

SOFTNESS_PX = (0.7, 1.6)
"""From a sharp small picture to one taken by hand: optics, demosaicing, a little movement and
resampling together."""
APERTURE_MM = (1.0, 5.0)
ELECTRONS_AT_WHITE = (6_000.0, 60_000.0)
READ_NOISE_ELECTRONS = (2.0, 6.0)
GAIN_PER_STOP = 0.5
MAX_GAIN_STOPS = 4.0


@dataclass(frozen=True)
class CameraLook:
    """What a camera does to light on its way to a picture; zeros do nothing.

    softness is the standard deviation of the lens's and sensor's blur in pixels of a picture whose
    shorter side is 640; aperture_mm is the entrance pupil's diameter, by which the far background
    falls out of focus; shot and read noise are variances in shares of white (of the light itself,
    and of any light), drawn for every pixel by noise_seed.
    """

    softness: float
    aperture_mm: float
    shot_noise: float
    read_noise: float
    noise_seed: int


PLAIN_LOOK = CameraLook(0.0, 0.0, 0.0, 0.0, 0)
"""A pinhole without noise."""


def draw_camera_look(rng: np.random.Generator, exposure_ev: float) -> CameraLook:
    """Draw a camera between a telephone's and a large one's.

    A sensor's noise is Poisson's of the electrons that it counted, and of its read-out; a pixel
    here stands for several of a telephone's sensor. Light that is low (exposure_ev above 0, what
    the picture was lifted by) is half made up by exposure time and half by gain, so that fewer
    electrons are white.
    """
    softness = _log_uniform(rng, SOFTNESS_PX)
    aperture_mm = _log_uniform(rng, APERTURE_MM)
    gain = 2.0 ** min(max(GAIN_PER_STOP * exposure_ev, 0.0), MAX_GAIN_STOPS)
    white = _log_uniform(rng, ELECTRONS_AT_WHITE) / gain
    read = _log_uniform(rng, READ_NOISE_ELECTRONS)
    seed = int(rng.integers(0, 2**63 - 1))
    return CameraLook(softness, aperture_mm, 1.0 / white, (read / white) ** 2, seed)


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    low, high = (math.log(limit) for limit in limits)
    return math.exp(float(rng.uniform(low, high)))
