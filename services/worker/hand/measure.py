"""Lengths, breadths and girths of hands, measured as anthropometrists do."""

import numpy as np

from services.worker.hand.asset import F8, I4
from services.worker.hand.bones import BONE_INDEX
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.rotation import unit
from services.worker.hand.surface import limb_section

THUMB = [
    PARTS.index(part)
    for part in (HandPart.THUMB_METACARPAL, HandPart.THUMB_PROXIMAL, HandPart.THUMB_DISTAL)
]
BREADTH_BAND_M = 0.004
FINGERTIP_M = 0.015
WRIST_BEHIND_M = 0.02


def hand_length_m(heads_m: F8, tails_m: F8, skin_m: F8) -> float:
    """From the wrist joint, level with the stylion, to the tip of the straightened middle finger.

    heads_m, tails_m (B,3) bones and skin_m (W,3) smooth skin at rest, in the hand's frame.
    """
    rows = [BONE_INDEX[f"middle_{segment}"] for segment in ("proximal", "middle", "distal")]
    bones_m = tails_m[rows] - heads_m[rows]
    way = unit(bones_m[-1])
    beyond_m = np.einsum("wk,k->w", skin_m - tails_m[rows[-1]], way)
    finger = np.linalg.norm(skin_m - tails_m[rows[-1]], axis=1) < FINGERTIP_M
    straight_m = heads_m[rows[0], 1] + np.linalg.norm(bones_m, axis=1).sum()
    return float(straight_m + beyond_m[finger].max())


def hand_breadth_m(skin_m: F8, part: I4, keypoints_m: F8) -> float:
    """Across the ends of metacarpals 2 and 5, without the thumb, in the hand's frame.

    skin_m (W,3), part (W,) of the smooth skin at rest; keypoints_m (21,3).
    """
    level_m = keypoints_m[[5, 17], 1].mean()
    across = (np.abs(skin_m[:, 1] - level_m) < BREADTH_BAND_M) & ~np.isin(part, THUMB)
    return float(np.ptp(skin_m[across, 0]))


def girth_m(centre_m: F8, way: F8, skin_m: F8, faces: I4) -> float:
    """Round a limb or finger through a point (3,) inside it, across a way (3,)."""
    ring_m = limb_section(centre_m, way, skin_m, faces).points_m
    return float(np.linalg.norm(ring_m - np.roll(ring_m, 1, axis=0), axis=1).sum())


def wrist_girth_m(heads_m: F8, skin_m: F8, faces: I4) -> float:
    """Round the forearm, WRIST_BEHIND_M behind the wrist joint."""
    way = unit(heads_m[BONE_INDEX["forearm"]])
    return girth_m(WRIST_BEHIND_M * way, way, skin_m, faces)
