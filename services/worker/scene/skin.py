"""Skin by its typology angle: colours of back, palm and nails, scattering.

The back's colour lies on one smooth line through six published points of human skin. In the plane
of b* and L* - 50 an angle ITA is a ray; the line is given by its distance from the plane's origin,
so every angle of -90..70 has its colour, exactly. Redness follows from the hue, which hardly
changes: dark skin stays a warm brown. Palms come from a two-layer melanin model with a fifth of
the melanin; nail beds are palms, redder and bluer, on dark skin a muted brown-pink.
"""

import math

import numpy as np
import numpy.typing as npt

from services.worker.hand.skinmaps.planes import PLANES
from services.worker.scene.colour import Lab, lab_to_linear_rgb
from services.worker.scene.complexion import individual, interpolated, pigment_of, relief_of
from services.worker.scene.scattering import mean_free_path_mm
from services.worker.scene.types import Rgb, Skin

MIN_ITA_DEG, MAX_ITA_DEG = -90.0, 70.0

_RADIUS = (29.8, 29.3, 20.0, 20.8, 21.5, 23.3, 23.7, 24.5)
"""Distance of the locus from (b* 0, L* 50): the published points, and a plausible way on."""
_HUE_DEG = (46.0, 46.0, 54.0, 58.6, 59.0, 59.9, 55.9, 49.0)
"""Hue angle of a* and b*."""
_PALM_LAB: tuple[Lab, ...] = (
    (48.0, 12.0, 18.5),
    (50.0, 12.5, 19.0),
    (57.0, 13.0, 19.5),
    (61.5, 12.5, 18.0),
    (64.5, 12.0, 16.5),
    (66.5, 11.5, 15.5),
    (68.5, 11.0, 14.0),
    (71.5, 9.5, 12.0),
)
_REDNESS_SPREAD, _RADIUS_SPREAD = 0.9, 0.035
_MAX_SPREAD = 2.0

_NAIL_LAB: tuple[Lab, ...] = (
    (39.0, 10.5, 9.0),
    (40.0, 11.0, 9.5),
    (51.0, 13.0, 12.0),
    (59.0, 14.5, 13.0),
    (63.0, 14.5, 12.5),
    (66.0, 14.5, 12.0),
    (68.0, 14.5, 11.5),
    (71.0, 13.5, 10.5),
)
LOWEST_ALBEDO, HIGHEST_ALBEDO = 0.004, 0.92

ROUGHNESS, ROUGHNESS_SPREAD = 0.52, 0.03
EDGE_FROM = (0.70, 0.86)
"""How far along a nail its free edge may begin."""


def skin_of(ita_deg: float, age_years: float, rng: np.random.Generator) -> Skin:
    """Draw a skin whose dorsum has exactly this typology angle.

    Redness and undertone vary a little at the same angle; spots, wrinkles and veins grow with age.
    ValueError for an angle outside -90..70.
    """
    if not MIN_ITA_DEG <= ita_deg <= MAX_ITA_DEG:
        raise ValueError(f"ita_deg is {ita_deg}; it must lie in {MIN_ITA_DEG}..{MAX_ITA_DEG}")
    draws = np.clip(rng.standard_normal(3), -_MAX_SPREAD, _MAX_SPREAD)
    redness = float(draws[0])
    dorsum = lab_to_linear_rgb(in_gamut(_varied(ita_deg, redness, float(draws[1]))))
    redder = _REDNESS_SPREAD * redness
    palm = _shifted(_between(ita_deg, _PALM_LAB), redder)
    nail = _shifted(_between(ita_deg, _NAIL_LAB), 0.5 * redder)
    edge_from, lunula = float(rng.uniform(*EDGE_FROM)), float(rng.uniform(0.15, 1.0))
    own = individual(rng)
    return Skin(
        ita_deg=ita_deg,
        age_years=age_years,
        dorsum_rgb=dorsum,
        palm_rgb=palm,
        nail_rgb=nail,
        pigment=pigment_of(ita_deg, age_years, (dorsum, palm), own),
        relief=relief_of(age_years, own),
        mean_free_path_mm=mean_free_path_mm(dorsum),
        roughness=ROUGHNESS + ROUGHNESS_SPREAD * float(draws[2]) / _MAX_SPREAD,
        nail_polish=None,
        nail_edge_from=edge_from,
        lunula=lunula,
    )


def dorsum_lab(ita_deg: float) -> Lab:
    """Return the mean CIELAB colour of the back of the hand, without individual variation."""
    return in_gamut(_varied(ita_deg, 0.0, 0.0))


def base_rgb(skin: Skin, dorsum: npt.NDArray[np.floating]) -> Rgb:
    """Return the albedo of bare skin under no layer so that the dorsum's mean is dorsum_rgb.

    dorsum (N, K): values of all PLANES at points that share the dorsum's area, as SkinMaps.dorsum.
    """
    values = dorsum.astype(np.float64)
    log_change = np.zeros((len(values), 3))
    for layer in skin.pigment.layers:
        for plane, weight in layer.mix:
            log_change += weight * values[:, [PLANES.index(plane)]] * np.array(layer.rgb)
    red, green, blue = (np.array(skin.dorsum_rgb) / np.exp(log_change).mean(axis=0)).tolist()
    return red, green, blue


def _varied(ita_deg: float, redness: float, undertone: float) -> Lab:
    radius = interpolated(ita_deg, _RADIUS) * (1.0 + _RADIUS_SPREAD * undertone)
    angle = math.radians(ita_deg)
    b = radius * math.cos(angle)
    a = b / math.tan(math.radians(interpolated(ita_deg, _HUE_DEG)))
    a += _REDNESS_SPREAD * redness * min(1.0, a / 10.0)
    return 50.0 + radius * math.sin(angle), a, b


def in_gamut(lab: Lab) -> Lab:
    """Take redness away until the colour is a possible albedo; the typology angle stays."""
    lightness, a, b = lab
    while a > 0.0 and not all(
        LOWEST_ALBEDO <= value <= HIGHEST_ALBEDO for value in lab_to_linear_rgb((lightness, a, b))
    ):
        a -= 0.25
    return lightness, max(a, 0.0), b


def _between(ita_deg: float, labs: tuple[Lab, ...]) -> Lab:
    lightness, a, b = (interpolated(ita_deg, column) for column in zip(*labs, strict=True))
    return lightness, a, b


def _shifted(lab: Lab, redder: float) -> Rgb:
    return lab_to_linear_rgb((lab[0], lab[1] + redder, lab[2]))
