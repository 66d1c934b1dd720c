"""How far the camera takes the colour of the light out of the picture.

Every camera that photographs people balances white by itself, and none does it all the way: a room
by lamplight stays a little warm, a hand in blue shade a little blue. Untouched, the light of a
clear sky makes dark skin lavender, as no photograph shows it.
"""

import math

import numpy as np

from services.worker.places.develop import LUMINANCE
from services.worker.scene.types import Rgb

ADAPTED = (0.55, 0.95)
"""Share of the cast, in stops, that is taken out."""
MOST_STOPS = 1.3
"""No camera follows a coloured lamp farther than this from white, in any channel."""
GAIN_DECIMALS = 4
"""Coarser than what processors disagree about in a sum, finer than a step of 8 bits."""
_FAINTEST = 1e-3


def draw_adaptation(rng: np.random.Generator) -> float:
    """Draw how much of the cast this camera takes out."""
    return float(rng.uniform(*ADAPTED))


def white_balance_of(white: Rgb, adapted: float) -> Rgb:
    """Return the gains of red, green and blue for light that makes a white thing look `white`.

    Such a thing keeps its luminance (of 1, as `white` has) and loses the share `adapted` of its
    colour, up to MOST_STOPS a channel. Neutral light has gains of exactly 1.
    """
    stops = [-adapted * math.log2(max(level, _FAINTEST)) for level in white]
    gains = np.exp2(np.clip(stops, -MOST_STOPS, MOST_STOPS))
    gains /= float(gains @ (LUMINANCE * np.array(white)))
    red, green, blue = np.round(gains, GAIN_DECIMALS).tolist()
    return red, green, blue
