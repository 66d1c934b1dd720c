"""What weight, muscle and age do to a hand's flesh, as pads, finger girths and limb girths.

MakeHuman's own builds hardly differ below the wrist. Each physique here is what one end of a
factor adds to the average hand; builds.py says how much of each a shape has.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from services.worker.hand.asset import F8
from services.worker.hand.bones import FINGERS
from services.worker.hand.flesh import DORSAL, PALMAR, RADIAL, ULNAR, Pad, sized

KNUCKLES = (5, 9, 13, 17)


@dataclass(frozen=True, eq=False)
class Physique:
    """A change of flesh: pads; girth added to digits at profile.STATIONS and to the forearm."""

    pads: list[Pad]
    girths: Mapping[str, tuple[float, ...]]
    limb_girth: float


def _girths(finger: tuple[float, ...], thumb: tuple[float, ...]) -> dict[str, tuple[float, ...]]:
    return {"thumb": thumb} | dict.fromkeys(FINGERS, finger)


FAT_GIRTHS = _girths((0.13, 0.06, 0.12, 0.04, 0.03), (0.14, 0.07, 0.05))
"""Heavy fingers are cones: thick flesh about the shafts, in which the joints drown."""
THIN_GIRTHS = _girths((-0.11, -0.01, -0.10, -0.01, -0.03), (-0.09, -0.01, -0.03))
"""Thin fingers show their bones: heads of phalanges keep their breadth, the shafts do not."""
OLD_GIRTHS = _girths((-0.07, 0.06, -0.05, 0.08, -0.01), (-0.05, 0.06, 0.0))
"""With age joints thicken while the flesh between them goes."""
MUSCLE_GIRTHS = _girths((0.025, 0.01, 0.01, 0.0, 0.0), (0.06, 0.02, 0.0))


def bare(keypoints_m: F8, size: float) -> Physique:
    """A back without fat: hollows between the metacarpals and in the web, heads of knuckles."""
    k = keypoints_m
    pads = [
        Pad(near, far, 0.0046, -0.0040, DORSAL) for near, far in _between_metacarpals(keypoints_m)
    ]
    web = 0.5 * k[5] + 0.5 * k[2]
    pads.append(Pad(0.4 * k[1] + 0.6 * web, web, 0.008, -0.0035, DORSAL))
    pads += [Pad(m, m, 0.0052, 0.0026, DORSAL) for m in k[list(KNUCKLES)]]
    return Physique(sized(pads, size), {}, 0.0)


def thin(keypoints_m: F8, size: float) -> Physique:
    """A thin hand: narrow shafts and wrist, flat balls, a hollow palm."""
    pads = [*_balls(keypoints_m, -0.0024, -0.0022), _edge(keypoints_m, -0.0012)]
    return Physique(sized(pads, size), THIN_GIRTHS, -0.07)


def fat(keypoints_m: F8, size: float) -> Physique:
    """A heavy hand: thick flesh over its back with dimples for knuckles, full balls."""
    k = keypoints_m
    back = Pad(0.6 * k[0] + 0.4 * k[9], 0.2 * k[0] + 0.8 * k[9], 0.024, 0.0052, DORSAL)
    dimples = [Pad(m, m, 0.0050, -0.0046, DORSAL) for m in k[list(KNUCKLES)]]
    cushions = [Pad(m, m, 0.009, 0.0016, PALMAR) for m in k[list(KNUCKLES)]]
    web = 0.45 * k[5] + 0.55 * k[2]
    pads = [back, *dimples, *cushions, *_balls(k, 0.0045, 0.0042), _edge(k, 0.0012)]
    pads.append(Pad(0.4 * k[1] + 0.6 * web, web, 0.010, 0.0026, DORSAL))
    return Physique(sized(pads, size), FAT_GIRTHS, 0.08)


def muscular(keypoints_m: F8, size: float) -> Physique:
    """A muscular hand: balls, the first dorsal interosseous, wrist and forearm."""
    k = keypoints_m
    first = Pad(0.45 * k[1] + 0.55 * k[5], 0.2 * k[2] + 0.8 * k[5], 0.010, 0.0054, DORSAL)
    side = Pad(0.6 * k[1] + 0.4 * k[5], 0.25 * k[1] + 0.75 * k[5], 0.009, 0.0044, RADIAL)
    pads = [first, side, *_balls(k, 0.0062, 0.0050), _edge(k, 0.0008)]
    return Physique(sized(pads, size), MUSCLE_GIRTHS, 0.085)


def old(keypoints_m: F8, size: float) -> Physique:
    """An old hand beside its bare back: wide joints, sinews, flattened balls."""
    k = keypoints_m
    sinews = [
        Pad(0.6 * k[0] + 0.4 * m, 0.1 * k[0] + 0.9 * m, 0.0028, 0.0018, DORSAL)
        for m in k[list(KNUCKLES)]
    ]
    pads = [*sinews, *_balls(k, -0.0018, -0.0016)]
    return Physique(sized(pads, size), OLD_GIRTHS, -0.02)


def physiques(keypoints_m: F8, size: float) -> list[Physique]:
    """Every physique, in the order of builds.physique_amounts."""
    return [make(keypoints_m, size) for make in (bare, thin, fat, muscular, old)]


def _balls(k: F8, thenar_m: float, hypothenar_m: float) -> list[Pad]:
    """The balls of thumb and little finger, higher by so much."""
    thumb = Pad(0.7 * k[1] + 0.3 * k[0], 0.35 * k[1] + 0.65 * k[2], 0.013, thenar_m, PALMAR)
    ulnar = k[17] + np.array([0.004, 0.0, 0.0])
    little = Pad(
        0.75 * k[0] + 0.25 * ulnar, 0.35 * k[0] + 0.65 * ulnar, 0.012, hypothenar_m, PALMAR
    )
    return [thumb, little]


def _edge(k: F8, height_m: float) -> Pad:
    """The edge of the hand on the little finger's side."""
    return Pad(0.75 * k[0] + 0.25 * k[17], 0.25 * k[0] + 0.75 * k[17], 0.013, height_m, ULNAR)


def _between_metacarpals(keypoints_m: F8) -> list[tuple[F8, F8]]:
    wrist = keypoints_m[0]
    middles = [0.5 * (one + other) for one, other in pairwise(keypoints_m[list(KNUCKLES)])]
    return [(0.6 * wrist + 0.4 * m, 0.1 * wrist + 0.9 * m) for m in middles]
