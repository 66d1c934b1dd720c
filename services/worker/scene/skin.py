"""Skin of the six tones: albedo of back, palm and nails, and how far light travels inside.

Back-of-hand colours lie on published loci of human skin with L* fixed by the typology angle; palms
come from a two-layer melanin model with a fifth of the melanin; nail beds are palms, a little
redder and bluer. The mean free path is the in-vivo reduced scattering of a cohort of 3,809 people
(power law at 610, 545 and 460 nm): melanin absorbs but hardly scatters, so one path serves all.
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

from hi5_common.domain.vocabulary import SKIN_TONE_ITA_DEG, SkinTone
from services.worker.scene.colour import Lab, lab_to_linear_rgb
from services.worker.scene.types import Rgb, Skin

MEAN_FREE_PATH_MM: Rgb = (0.47, 0.39, 0.29)
ROUGHNESS = 0.5

_DORSUM_AB: Mapping[SkinTone, tuple[float, float]] = MappingProxyType(
    {
        SkinTone.VERY_LIGHT: (8.0, 13.6),
        SkinTone.LIGHT: (8.9, 17.6),
        SkinTone.INTERMEDIATE: (10.3, 19.0),
        SkinTone.TAN: (11.8, 20.5),
        SkinTone.BROWN: (12.3, 17.3),
        SkinTone.DARK: (4.5, 4.6),
    }
)
_PALM_LAB: Mapping[SkinTone, Lab] = MappingProxyType(
    {
        SkinTone.VERY_LIGHT: (68.5, 11.0, 14.0),
        SkinTone.LIGHT: (66.5, 11.5, 15.5),
        SkinTone.INTERMEDIATE: (64.5, 12.0, 16.5),
        SkinTone.TAN: (61.5, 12.5, 18.0),
        SkinTone.BROWN: (57.0, 13.0, 19.5),
        SkinTone.DARK: (50.0, 12.5, 19.0),
    }
)


def skin_of(tone: SkinTone) -> Skin:
    """Return the skin of a tone; the typology angle of its dorsum is the tone's exactly."""
    lightness, a, b = _PALM_LAB[tone]
    return Skin(
        ita_deg=SKIN_TONE_ITA_DEG[tone],
        dorsum_rgb=lab_to_linear_rgb(dorsum_lab(tone)),
        palm_rgb=lab_to_linear_rgb((lightness, a, b)),
        nail_rgb=lab_to_linear_rgb((lightness, a + 2.0, b - 4.0)),
        mean_free_path_mm=MEAN_FREE_PATH_MM,
        roughness=ROUGHNESS,
    )


def dorsum_lab(tone: SkinTone) -> Lab:
    """Return the CIELAB colour of the back of the hand: L* = 50 + b* tan(ITA)."""
    a, b = _DORSUM_AB[tone]
    return 50.0 + b * math.tan(math.radians(SKIN_TONE_ITA_DEG[tone])), a, b
