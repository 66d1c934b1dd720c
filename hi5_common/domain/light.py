"""How bright a place is, in a word: low light is wanted in a dataset, but it is labelled."""

import math
from enum import StrEnum


class LightLevel(StrEnum):
    """The light of an environment, whatever the exposure that a picture of it was taken with."""

    LOW = "low"
    ORDINARY = "ordinary"
    BRIGHT = "bright"


LOW_BELOW = 0.25
BRIGHT_FROM = 1.5
"""Mean luminance over the whole sphere, in a panorama's own units.

In those units a diffuse white thing in plain view is near 1: panoramas are published so that they
look right when shown as they are. Below a quarter of that (two stops) the average of all that is
around is no brighter than a grey card, which only night and dim rooms are. From one and a half
times on, more light comes from everywhere than white reflects, which takes open sun, snow or
studio lamps. A panorama in absolute units (candela per square metre) is `bright` by this measure.
"""


def light_level(luminance: float) -> LightLevel:
    """Return the word for an environment's mean luminance (finite and >= 0, else ValueError)."""
    if not (math.isfinite(luminance) and luminance >= 0.0):
        raise ValueError(f"{luminance} is not a luminance")
    if luminance < LOW_BELOW:
        return LightLevel.LOW
    return LightLevel.BRIGHT if luminance >= BRIGHT_FROM else LightLevel.ORDINARY
