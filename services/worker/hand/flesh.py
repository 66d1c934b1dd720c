"""Pads and hollows under the skin: smooth swellings along lines of the hand at rest.

The asset's hand is that of a doll: flat palm, even back. These fields give it the balls of thumb
and little finger, the cushions below the fingers, knuckles, and what fat, age and bending do there.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from services.worker.hand.asset import F8
from services.worker.hand.bones import FINGERS
from services.worker.hand.growth import finger_flesh
from services.worker.hand.maps import smoothstep
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit

DORSAL, PALMAR = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
FACING = (0.0, 0.7)
"""Skin takes part in a pad as it faces its way: from not at all to wholly over these cosines."""


@dataclass(frozen=True, eq=False)
class Pad:
    """A swelling (or, of negative height, a hollow) along a line.

    start_m, end_m (3,); width_m: standard deviation across the line; way (3,): where it swells.
    """

    start_m: F8
    end_m: F8
    width_m: float
    height_m: float
    way: F8


def pads_shift_m(vertices_m: F8, normals: F8, pads: Iterable[Pad]) -> F8:
    """Shift (V,3) of skin with normals (V,3): each pad along the normals, as seen from its way."""
    height_m = np.zeros(len(vertices_m))
    for pad in pads:
        distance_m = _distance_m(vertices_m, pad)
        facing = smoothstep(*FACING, np.einsum("vk,k->v", normals, pad.way))
        height_m += pad.height_m * facing * np.exp(-0.5 * (distance_m / pad.width_m) ** 2)
    shift: F8 = height_m[:, None] * normals
    return shift


def _distance_m(points_m: F8, pad: Pad) -> F8:
    """Distance (V,) from the pad's line, seen along its way."""

    def flat(vectors: F8) -> F8:
        across: F8 = vectors - np.einsum("...k,k->...", vectors, pad.way)[..., None] * pad.way
        return across

    line, offset = flat(pad.end_m - pad.start_m), flat(points_m - pad.start_m)
    share = np.clip(np.einsum("vk,k->v", offset, line) / max(float(line @ line), 1e-12), 0.0, 1.0)
    distance: F8 = np.linalg.norm(offset - share[:, None] * line, axis=1)
    return distance


def pulp_pads(keypoints_m: F8, hinges: F8, size: float) -> list[Pad]:
    """The pulps of the fingertips, which the asset cuts off aslant. hinges (5,3)."""
    pads = []
    for row, hinge in enumerate(hinges):
        joint, tip = keypoints_m[3 + 4 * row], keypoints_m[4 + 4 * row]
        palmar = unit(np.cross(hinge, tip - joint))
        pads.append(Pad(0.3 * joint + 0.7 * tip, tip, 0.0045, 0.0013, palmar))
    return [_sized(pad, size) for pad in pads]


def resting_pads(keypoints_m: F8, size: float) -> list[Pad]:
    """What the asset's hand lacks at rest; heights for a hand of size 1 (a man's)."""
    k = keypoints_m
    thenar = Pad(0.7 * k[1] + 0.3 * k[0], 0.35 * k[1] + 0.65 * k[2], 0.012, 0.0022, PALMAR)
    ulnar = k[17] + np.array([0.006, 0.0, 0.0])
    hypothenar = Pad(0.75 * k[0] + 0.25 * ulnar, 0.4 * k[0] + 0.6 * ulnar, 0.011, 0.0022, PALMAR)
    centre = 0.35 * k[0] + 0.65 * (0.5 * k[9] + 0.5 * k[13])
    hollow = Pad(0.3 * k[0] + 0.7 * centre, centre, 0.011, -0.0022, PALMAR)
    pads = [thenar, hypothenar, hollow]
    for finger in range(4):
        mcp, pip = k[5 + 4 * finger], k[6 + 4 * finger]
        cushion = mcp + 0.15 * (mcp - k[0]) * [0.0, -1.0, 0.0] + 0.1 * (pip - mcp)
        pads.append(Pad(cushion, cushion, 0.007, 0.0010, PALMAR))
        pads.append(Pad(mcp, mcp, 0.006, 0.0008, DORSAL))
    return [_sized(pad, size) for pad in pads]


def lean_pads(keypoints_m: F8, size: float) -> list[Pad]:
    """What a hand without fat shows: hollows between the metacarpals, knuckles, the first web."""
    pads = _between_metacarpals(keypoints_m, -0.0020)
    web = 0.5 * keypoints_m[5] + 0.5 * keypoints_m[2]
    pads.append(Pad(0.4 * keypoints_m[1] + 0.6 * web, web, 0.008, -0.0022, DORSAL))
    pads += [Pad(k, k, 0.0055, 0.0011, DORSAL) for k in keypoints_m[[5, 9, 13, 17]]]
    return [_sized(pad, size) for pad in pads]


def fat_pads(keypoints_m: F8, size: float) -> list[Pad]:
    """Where fat lies in a heavy hand: its back, its balls, the cushions below the fingers."""
    k = keypoints_m
    back = Pad(0.6 * k[0] + 0.4 * k[9], 0.25 * k[0] + 0.75 * k[9], 0.020, 0.0022, DORSAL)
    thenar = Pad(0.7 * k[1] + 0.3 * k[0], 0.3 * k[1] + 0.7 * k[2], 0.013, 0.0025, PALMAR)
    hypothenar = Pad(0.75 * k[0] + 0.25 * k[17], 0.4 * k[0] + 0.6 * k[17], 0.013, 0.0025, PALMAR)
    dimples = [Pad(m, m, 0.006, -0.0014, DORSAL) for m in k[[5, 9, 13, 17]]]
    return [_sized(pad, size) for pad in [back, thenar, hypothenar, *dimples]]


def _between_metacarpals(keypoints_m: F8, height_m: float) -> list[Pad]:
    wrist, knuckles = keypoints_m[0], keypoints_m[[5, 9, 13, 17]]
    pads = []
    for one, other in pairwise(knuckles):
        middle = 0.5 * (one + other)
        near, far = 0.55 * wrist + 0.45 * middle, 0.12 * wrist + 0.88 * middle
        pads.append(Pad(near, far, 0.0048, height_m, DORSAL))
    return pads


KNUCKLE_HEIGHTS_M = {"index": 0.0010, "middle": 0.0022, "ring": 0.0026, "pinky": 0.0032}
"""How far the head of a metacarpal comes out when its finger is bent by a right angle; skinning
alone thins the joint by as much."""


def knuckle_pad(keypoints_m: F8, finger: str, size: float) -> list[Pad]:
    """The head of a metacarpal, which comes out as the finger bends."""
    mcp = keypoints_m[1 + 4 * DIGITS.index(finger)]
    return [_sized(Pad(mcp, mcp, 0.0075, KNUCKLE_HEIGHTS_M[finger], DORSAL), size)]


def opposed_pads(keypoints_m: F8, size: float) -> list[Pad]:
    """The ball of the thumb, which bunches as the thumb crosses the palm."""
    k = keypoints_m
    return [_sized(Pad(0.6 * k[1] + 0.4 * k[0], 0.5 * (k[1] + k[2]), 0.012, 0.003, PALMAR), size)]


def _sized(pad: Pad, size: float) -> Pad:
    return Pad(pad.start_m, pad.end_m, size * pad.width_m, size * pad.height_m, pad.way)


def fat_fingers_shift_m(vertices_m: F8, weights: F8, lines_m: dict[str, F8]) -> F8:
    """Shift (V,3) of a heavy hand's fingers: thick at the base, less so towards the tip."""
    shift_m = np.zeros_like(vertices_m)
    for digit, line_m in lines_m.items():
        flesh = finger_flesh(vertices_m, weights, digit, line_m)
        length_m = float(np.linalg.norm(np.diff(line_m, axis=0), axis=1).sum())
        growth = np.interp(flesh.along_m / length_m, [0.2, 0.45, 1.0], FAT_GIRTH)
        shift_m += (flesh.share * growth)[:, None] * flesh.radial_m
    return shift_m


FAT_GIRTH = (0.11, 0.09, 0.04)
"""By how much the girth of a heavy hand's fingers exceeds the average, base to tip."""

CORRECTIVES: tuple[str, ...] = (*(f"{finger}_knuckle" for finger in FINGERS), "opposed_thumb")
"""Shapes that come with bending, in the order of HandModel.correctives_m."""
