"""Pads and hollows under the skin: smooth swellings along lines of the hand at rest.

The asset's hand is that of a doll: flat palm, even back. These fields give it the balls of thumb
and little finger, the cushions below the fingers, knuckles, and what bending does there.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from services.worker.hand.asset import F8
from services.worker.hand.bones import FINGERS
from services.worker.hand.maps import smoothstep
from services.worker.hand.rotation import unit

DORSAL, PALMAR = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
ULNAR, RADIAL = np.array([1.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])
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
    return sized(pads, size)


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
    return sized(pads, size)


KNUCKLE_HEIGHTS_M = {"index": 0.0030, "middle": 0.0052, "ring": 0.0050, "pinky": 0.0048}
"""How far the head of a metacarpal comes out when its finger is bent by a right angle; skinning
alone thins the joint by half as much."""
VALLEY_M = -0.0036
FLANKS_M = (0.0024, 0.0009, 0.0014)
"""Flanks between index and middle, middle and ring, ring and little finger: the asset's index
stands far from the middle finger."""


def knuckle_pads(keypoints_m: F8, finger: str, size: float) -> list[Pad]:
    """What bending a finger at the knuckle brings out.

    The head of its metacarpal; half of the valleys to its neighbours' heads; its own flanks, whose
    flesh is squeezed out towards its neighbours.
    """
    row = FINGERS.index(finger)
    mcp, pip = keypoints_m[5 + 4 * row], keypoints_m[6 + 4 * row]
    pads = [Pad(mcp, mcp, 0.0065, KNUCKLE_HEIGHTS_M[finger], DORSAL)]
    for side, other in ((RADIAL, row - 1), (ULNAR, row + 1)):
        if 0 <= other < len(FINGERS):
            valley = 0.5 * (mcp + keypoints_m[5 + 4 * other])
            pads.append(Pad(valley, valley, 0.0042, 0.5 * VALLEY_M, DORSAL))
            near, far = 0.8 * mcp + 0.2 * pip, 0.25 * mcp + 0.75 * pip
            pads.append(Pad(near, far, 0.0060, FLANKS_M[min(row, other)], side))
    return sized(pads, size)


WEB_WAY = unit(np.array([-0.85, 0.15, -0.5]))


def opposed_pads(keypoints_m: F8, size: float) -> list[Pad]:
    """The ball of the thumb, which bunches as the thumb crosses the palm, and its web, whose skin
    then stands out instead of falling into a pit.
    """
    k = keypoints_m
    ball = Pad(0.6 * k[1] + 0.4 * k[0], 0.5 * (k[1] + k[2]), 0.012, 0.003, PALMAR)
    web = Pad(0.55 * k[2] + 0.45 * k[5], 0.35 * k[2] + 0.65 * k[5], 0.0085, 0.0030, WEB_WAY)
    return sized([ball, web], size)


def sized(pads: Iterable[Pad], size: float) -> list[Pad]:
    """The pads of a hand whose breadth is `size` times a man's."""
    return [
        Pad(pad.start_m, pad.end_m, size * pad.width_m, size * pad.height_m, pad.way)
        for pad in pads
    ]


CORRECTIVES: tuple[str, ...] = (*(f"{finger}_knuckle" for finger in FINGERS), "opposed_thumb")
"""Shapes that come with bending, in the order of HandModel.correctives_m."""
