"""One person's skin over the maps: which lines, veins and spots show, how strongly, at what age."""

import math
from dataclasses import dataclass

import numpy as np

from services.worker.hand.skinmaps.planes import Plane
from services.worker.scene.monotone import monotone_cubic
from services.worker.scene.types import Layer, Mix, Pigment, Relief, Rgb

ANCHOR_ITA_DEG = (-90.0, -80.0, -30.0, 10.0, 28.0, 41.0, 55.0, 70.0)

_MELANIN = (1.0, 1.0, 1.0, 0.8, 0.6, 0.5, 0.42, 0.4)
_BLOOD = (0.12, 0.14, 0.30, 0.40, 0.44, 0.47, 0.47, 0.47)
_VEIN = (0.07, 0.08, 0.11, 0.15, 0.18, 0.20, 0.22, 0.23)
_SPOT = (0.10, 0.12, 0.25, 0.5, 0.8, 1.0, 1.0, 1.0)
_LINE = (0.95, 0.95, 0.95, 0.95, 1.0, 1.0, 1.0, 1.0)
MELANIN_SHAPE: Rgb = (-0.72, -1.0, -1.16)
BLOOD_SHAPE: Rgb = (-0.10, -0.95, -0.62)
VEIN_SHAPE: Rgb = (-1.0, -0.52, -0.30)
SPOT_SHAPE: Rgb = (-0.42, -0.75, -1.0)
LINE_SHAPE: Rgb = (-0.16, -0.42, -0.36)
"""What a unit of each layer does to the logarithm of red, green and blue albedo."""

PALM_LINE_MM, TENDON_MM, VEIN_MM = 0.42, 0.9, 0.6
SPOTS_YEARS, FOLDS_YEARS, VEINS_YEARS = (34.0, 82.0), (26.0, 80.0), (30.0, 85.0)
"""Ages between which each comes."""


@dataclass(frozen=True)
class Individual:
    """What a person is born with. Pairs weigh the two planes of a kind."""

    lines: tuple[float, float]
    fine_lines: float
    veins: tuple[float, float]
    sinewy: float
    freckles: tuple[float, float]
    age_spots: tuple[float, float]
    spotted: float
    mottle: tuple[float, float]
    blotch: tuple[float, float]
    uneven: float
    wrinkled: float


def individual(rng: np.random.Generator) -> Individual:
    """Draw a person: one set of palm lines with a trace of the other, fields at any mixture."""
    trace = float(rng.uniform(0.0, 0.15))
    lines = (1.0, trace) if rng.uniform() < 0.5 else (trace, 1.0)
    return Individual(
        lines=lines,
        fine_lines=float(rng.uniform(0.25, 1.0)),
        veins=_turned(rng.uniform(-0.1, 0.5 * math.pi + 0.1)),
        sinewy=float(rng.uniform(0.55, 1.35)),
        freckles=_turned(rng.uniform(0.0, 0.5 * math.pi)),
        age_spots=_turned(rng.uniform(0.0, 0.5 * math.pi)),
        spotted=float(rng.uniform(0.0, 1.0)),
        mottle=_turned(rng.uniform(0.0, 2.0 * math.pi)),
        blotch=_turned(rng.uniform(0.0, 2.0 * math.pi)),
        uneven=float(rng.uniform(0.7, 1.3)),
        wrinkled=float(rng.uniform(0.75, 1.25)),
    )


def pigment_of(
    ita_deg: float, age_years: float, colours: tuple[Rgb, Rgb], own: Individual
) -> Pigment:
    """Return the layers of a skin; colours are the albedos of back and palm."""
    old, folded = _share(age_years, SPOTS_YEARS), _share(age_years, FOLDS_YEARS)
    red, green, blue = (math.log(p / d) for d, p in zip(*colours, strict=True))
    dull = 1.0 + 0.9 * old
    thin = own.sinewy * (0.75 + 0.25 * _share(age_years, VEINS_YEARS))
    freckled = 0.6 * (0.12 + 0.75 * own.spotted**2)
    aged = old * (0.5 + 0.5 * own.spotted)
    blood: Mix = (
        (Plane.BLOOD, 0.5),
        *_pair(Plane.BLOTCH_A, Plane.BLOTCH_B, own.blotch, 0.5 * own.uneven * dull),
    )
    melanin: Mix = (
        (Plane.MELANIN, 0.5),
        *_pair(Plane.MOTTLE_A, Plane.MOTTLE_B, own.mottle, 0.5 * own.uneven * dull),
        # Heights of grooves are negative: what lies in a groove is darker.
        (Plane.PATTERN, -0.9),
        (Plane.WRINKLES, -0.6 - 0.4 * folded),
        (Plane.CREPE, -1.1 * folded),
    )
    lines: Mix = (
        *_pair(Plane.LINES_A, Plane.LINES_B, own.lines, 1.0),
        (Plane.LINES_FINE, 0.5 * own.fine_lines),
        (Plane.FLEXION, 0.9),
    )
    spots: Mix = (
        *_pair(Plane.FRECKLES_A, Plane.FRECKLES_B, own.freckles, freckled),
        *_pair(Plane.AGE_SPOTS_A, Plane.AGE_SPOTS_B, own.age_spots, 1.15 * aged),
    )
    veins = _pair(Plane.VEINS_A, Plane.VEINS_B, own.veins, thin)
    return Pigment(
        (
            Layer((red, green, blue), ((Plane.GLABROUS, 1.0),)),
            Layer(_scaled(BLOOD_SHAPE, interpolated(ita_deg, _BLOOD)), blood),
            Layer(_scaled(MELANIN_SHAPE, interpolated(ita_deg, _MELANIN)), melanin),
            Layer(_scaled(LINE_SHAPE, interpolated(ita_deg, _LINE)), lines),
            Layer(_scaled(VEIN_SHAPE, interpolated(ita_deg, _VEIN)), veins),
            Layer(_scaled(SPOT_SHAPE, interpolated(ita_deg, _SPOT)), spots),
        )
    )


def relief_of(age_years: float, own: Individual) -> Relief:
    """Return a skin's relief: smooth at twenty, folded, thin and crossed by cords at eighty."""
    folded, thin = _share(age_years, FOLDS_YEARS), _share(age_years, VEINS_YEARS)
    sinews = own.sinewy * (0.22 + 0.95 * thin)
    line_mm = -PALM_LINE_MM * (1.0 + 0.35 * folded)
    still: Mix = (
        (Plane.STILL, 1.0),
        *_pair(Plane.LINES_A, Plane.LINES_B, own.lines, line_mm),
        (Plane.LINES_FINE, 0.5 * line_mm * own.fine_lines),
        (Plane.PATTERN, 0.55 + 0.95 * folded),
        (Plane.TENDONS, TENDON_MM * sinews),
        *_pair(Plane.VEINS_A, Plane.VEINS_B, own.veins, VEIN_MM * (1.0 + 0.4 * thin) * sinews),
    )
    slack: Mix = (
        (Plane.WRINKLES, own.wrinkled * (0.7 + 1.3 * folded)),
        (Plane.CREPE, own.wrinkled * (0.04 + 1.15 * folded**1.3)),
    )
    return Relief(still, slack)


def interpolated(ita_deg: float, values: tuple[float, ...]) -> float:
    """Interpolate values at the anchors by a monotone cubic."""
    return monotone_cubic(ita_deg, ANCHOR_ITA_DEG, values)


def _pair(first: Plane, second: Plane, weights: tuple[float, float], factor: float) -> Mix:
    return ((first, factor * weights[0]), (second, factor * weights[1]))


def _turned(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


def _share(value: float, between: tuple[float, float]) -> float:
    t = min(max((value - between[0]) / (between[1] - between[0]), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


def _scaled(shape: Rgb, strength: float) -> Rgb:
    return (shape[0] * strength, shape[1] * strength, shape[2] * strength)
