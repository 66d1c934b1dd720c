"""Skin by its typology angle: colours of back, palm and nails, pigment, relief, scattering.

The back's colour lies on one smooth line through six published points of human skin. In the plane
of b* and L* - 50 an angle ITA is a ray; the line is given by its distance from the plane's origin,
so every angle of -90..70 has its colour, exactly. Palms come from a two-layer melanin model with a
fifth of the melanin; nail beds are palms, a little redder and bluer.
"""

import math

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from services.worker.scene.colour import Lab, lab_to_linear_rgb
from services.worker.scene.scattering import mean_free_path_mm
from services.worker.scene.types import Pigment, ReliefStrength, Rgb, Skin

MIN_ITA_DEG, MAX_ITA_DEG = -90.0, 70.0

_ANCHOR_ITA_DEG = (-90.0, -80.0, -30.0, 10.0, 28.0, 41.0, 55.0, 70.0)
_RADIUS = (29.5, 28.6, 20.0, 20.8, 21.5, 23.3, 23.7, 24.5)
"""Distance of the locus from (b* 0, L* 50): the published points, and a plausible way on."""
_REDNESS = (5.5, 7.8, 12.3, 12.5, 11.4, 10.2, 9.2, 7.5)
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

_MELANIN_STRENGTH = (1.25, 1.2, 1.1, 0.8, 0.6, 0.5, 0.42, 0.4)
_BLOOD_STRENGTH = (0.20, 0.22, 0.32, 0.40, 0.44, 0.47, 0.47, 0.47)
_VEIN_STRENGTH = (0.07, 0.08, 0.11, 0.15, 0.18, 0.20, 0.22, 0.23)
_NAIL_DARKER = (9.0, 9.0, 6.0, 3.0, 1.5, 0.0, 0.0, 0.0)
"""How much lower the L* of a nail bed is than the palm's: beds have some melanin, plates yellow."""
_FRECKLE_STRENGTH = (0.10, 0.12, 0.25, 0.5, 0.8, 1.0, 1.0, 1.0)
MELANIN_SHAPE: Rgb = (-0.72, -1.0, -1.16)
BLOOD_SHAPE: Rgb = (-0.10, -0.95, -0.62)
VEIN_SHAPE: Rgb = (-1.0, -0.52, -0.30)
SPOT_SHAPE: Rgb = (-0.42, -0.75, -1.0)
"""What a unit of each pigment does to the logarithm of red, green and blue albedo."""
LOWEST_ALBEDO, HIGHEST_ALBEDO = 0.004, 0.92

ROUGHNESS, ROUGHNESS_SPREAD = 0.52, 0.03
SPOTS_FROM_YEARS, SPOTS_FULL_YEARS = 32.0, 85.0


def skin_of(ita_deg: float, age_years: float, rng: np.random.Generator) -> Skin:
    """Draw a skin whose dorsum has exactly this typology angle.

    Redness and undertone vary a little at the same angle; spots, wrinkles and veins grow with age.
    ValueError for an angle outside -90..70.
    """
    if not MIN_ITA_DEG <= ita_deg <= MAX_ITA_DEG:
        raise ValueError(f"ita_deg is {ita_deg}; it must lie in {MIN_ITA_DEG}..{MAX_ITA_DEG}")
    draws = np.clip(rng.standard_normal(3), -_MAX_SPREAD, _MAX_SPREAD)
    uneven, spotted, sinewy = rng.uniform(0.7, 1.3), rng.uniform(0.0, 1.0), rng.uniform(0.55, 1.35)
    dorsum = lab_to_linear_rgb(_in_gamut(_varied(ita_deg, float(draws[0]), float(draws[1]))))
    lightness, a, b = _palm_lab(ita_deg)
    redder = _REDNESS_SPREAD * float(draws[0])
    palm = lab_to_linear_rgb((lightness, a + redder, b))
    return Skin(
        ita_deg=ita_deg,
        age_years=age_years,
        dorsum_rgb=dorsum,
        palm_rgb=palm,
        nail_rgb=lab_to_linear_rgb(
            (lightness - _at(ita_deg, _NAIL_DARKER), a + 2.0 + 0.5 * redder, b - 4.0)
        ),
        pigment=_pigment(ita_deg, age_years, (dorsum, palm), (uneven, spotted, sinewy)),
        relief=_relief(age_years, sinewy),
        mean_free_path_mm=mean_free_path_mm(dorsum),
        roughness=ROUGHNESS + ROUGHNESS_SPREAD * float(draws[2]) / _MAX_SPREAD,
        nail_polish=None,
    )


def dorsum_lab(ita_deg: float) -> Lab:
    """Return the mean CIELAB colour of the back of the hand, without individual variation."""
    return _in_gamut(_varied(ita_deg, 0.0, 0.0))


def base_rgb(skin: Skin, dorsum: npt.NDArray[np.floating]) -> Rgb:
    """Return the albedo of skin with neutral pigment so that the dorsum's mean is dorsum_rgb.

    dorsum (N, 6): pigment at points that share the dorsum's area, as SkinMaps.dorsum.
    """
    unlike = dorsum.astype(np.float64) - np.array(Pigment.NEUTRAL)
    log_change = np.einsum("nk,kc->nc", unlike, np.array(skin.pigment.gains()))
    red, green, blue = (np.array(skin.dorsum_rgb) / np.exp(log_change).mean(axis=0)).tolist()
    return red, green, blue


def _varied(ita_deg: float, redness: float, undertone: float) -> Lab:
    radius = _at(ita_deg, _RADIUS) * (1.0 + _RADIUS_SPREAD * undertone)
    a = _at(ita_deg, _REDNESS)
    a += _REDNESS_SPREAD * redness * min(1.0, a / 10.0)
    angle = math.radians(ita_deg)
    return 50.0 + radius * math.sin(angle), a, radius * math.cos(angle)


def _in_gamut(lab: Lab) -> Lab:
    """Take redness away until the colour is a possible albedo; the typology angle stays."""
    lightness, a, b = lab
    while a > 0.0 and not all(
        LOWEST_ALBEDO <= value <= HIGHEST_ALBEDO for value in lab_to_linear_rgb((lightness, a, b))
    ):
        a -= 0.25
    return lightness, max(a, 0.0), b


def _palm_lab(ita_deg: float) -> Lab:
    columns = list(zip(*_PALM_LAB, strict=True))
    return _at(ita_deg, columns[0]), _at(ita_deg, columns[1]), _at(ita_deg, columns[2])


def _at(ita_deg: float, values: tuple[float, ...]) -> float:
    """Interpolate values at the anchors by a monotone cubic (Fritsch and Carlson 1980)."""
    return float(PchipInterpolator(_ANCHOR_ITA_DEG, values)(ita_deg))


def _pigment(
    ita_deg: float, age_years: float, colours: tuple[Rgb, Rgb], drawn: tuple[float, float, float]
) -> Pigment:
    uneven, spotted, sinewy = drawn
    old = _share(age_years, SPOTS_FROM_YEARS, SPOTS_FULL_YEARS)
    freckled = _at(ita_deg, _FRECKLE_STRENGTH) * (0.12 + 0.75 * spotted**2)
    aged = _at(ita_deg, _FRECKLE_STRENGTH) * old * (0.35 + 0.6 * spotted)
    thin = sinewy * (0.75 + 0.6 * _share(age_years, 30.0, 85.0))
    palm = [math.log(p / d) for p, d in zip(colours[1], colours[0], strict=True)]
    return Pigment(
        glabrous=(palm[0], palm[1], palm[2]),
        blood=_scaled(BLOOD_SHAPE, _at(ita_deg, _BLOOD_STRENGTH) * uneven),
        melanin=_scaled(MELANIN_SHAPE, _at(ita_deg, _MELANIN_STRENGTH) * (0.8 + 0.2 * uneven)),
        veins=_scaled(VEIN_SHAPE, _at(ita_deg, _VEIN_STRENGTH) * thin),
        freckles=_scaled(SPOT_SHAPE, 0.6 * freckled),
        age_spots=_scaled(SPOT_SHAPE, 0.75 * aged),
    )


def _relief(age_years: float, sinewy: float) -> ReliefStrength:
    old = _share(age_years, 25.0, 85.0)
    return ReliefStrength(
        folds=1.0 + 0.3 * old,
        slack=0.85 + 0.9 * old,
        pattern=0.9 + 0.8 * old,
        sinews=sinewy * (0.22 + 0.95 * old),
    )


def _share(value: float, low: float, high: float) -> float:
    t = min(max((value - low) / (high - low), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


def _scaled(shape: Rgb, strength: float) -> Rgb:
    return (shape[0] * strength, shape[1] * strength, shape[2] * strength)
