"""Ways from any pose to any other on which no finger passes through another.

The straight way is taken where it is free. Else the thumb is lifted out of the way first and laid
down last; where that is not enough, the fingers open on the way too. Which detour a pair of poses
needs was tried out when the library was compiled (benchmarks/solve_paths.py).
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.angles import ANGLE_INDEX, ANGLE_NAMES, JointAngles
from services.worker.hand.bones import FINGERS
from services.worker.hand.limits import FLEXED_MCP_ABDUCTION_DEG, FLEXED_MCP_DEG
from services.worker.hand.shape import HandShape
from services.worker.scene.poses import solved_angles, within_limits
from services.worker.scene.types import Array

DETOUR_FILE = "detours.npz"
"""Written by benchmarks/solve_paths.py: (pose, pose) index into DETOURS, symmetric."""
EASED_DEG_PER_DEG = 1.5
"""How much sideways play a knuckle gains with every degree it is short of being flexed."""


@dataclass(frozen=True)
class Detour:
    """How far thumb and fingers leave the straight way in its middle (0..1), and for how long the
    fingers wait at either end while the thumb lifts (share of the way).
    """

    thumb: float
    fingers: float
    wait: float


DETOURS = (
    Detour(0.0, 0.0, 0.0),
    Detour(0.5, 0.0, 0.0),
    Detour(1.0, 0.0, 0.0),
    Detour(1.0, 0.0, 0.2),
    Detour(1.0, 0.5, 0.1),
    Detour(1.0, 1.0, 0.1),
    Detour(1.0, 1.0, 0.25),
)
"""From none to the longest."""
RISE = 0.3
"""Share of the way over which a detour swings out and, at the end, back."""

_OPEN = {
    "thumb_cmc_azimuth": 62.0,
    "thumb_cmc_palmar_abd": 48.0,
    "thumb_cmc_pronation": 0.0,
    "thumb_mcp_flex": 4.0,
    "thumb_ip_flex": 4.0,
    **{f"{finger}_mcp_flex": 4.0 for finger in FINGERS},
    **{f"{finger}_pip_flex": 12.0 for finger in FINGERS},
    **{f"{finger}_dip_flex": 6.0 for finger in FINGERS},
    "index_mcp_abd": 10.0,
    "middle_mcp_abd": 0.0,
    "ring_mcp_abd": 7.0,
    "pinky_mcp_abd": 18.0,
}
_OPEN_DEG = np.array([_OPEN.get(name, 0.0) for name in ANGLE_NAMES])
_THUMB = np.array([name.startswith("thumb") for name in ANGLE_NAMES])
_FINGER = np.array([name.startswith(FINGERS) for name in ANGLE_NAMES])


def between(gender: Gender, shape: HandShape, source: Pose, target: Pose, t: float) -> JointAngles:
    """The hand on its way from source (t = 0) to target (1): within limits, continuous in t.

    ValueError for t outside 0..1.
    """
    if not 0.0 <= t <= 1.0:
        raise ValueError(f"t is {t}; it must be from 0 to 1")
    start, end = (solved_angles(gender, pose, shape).as_array() for pose in (source, target))
    return along(start, end, DETOURS[_detours()[source, target]], t)


def goes_round(source: Pose, target: Pose) -> bool:
    """Whether the way between two poses leaves the straight one, opening the hand on the way."""
    return _detours()[source, target] != 0


def along(source_deg: Array, target_deg: Array, detour: Detour, t: float) -> JointAngles:
    """The place t (0..1) on the way between angles (26,), by a detour."""
    gone = _waited(t, detour.wait)
    angles = (1.0 - gone) * source_deg + gone * target_deg
    swing = _eased(min(t, 1.0 - t) / RISE)
    for digits, most in ((_THUMB, detour.thumb), (_FINGER, detour.fingers)):
        angles = angles + digits * most * swing * (_OPEN_DEG - angles)
    return within_limits(_held_sideways(angles))


def _waited(t: float, wait: float) -> float:
    """Progress 0..1 that rests over `wait` at either end and moves evenly, eased, between."""
    if wait == 0.0:
        return t
    return _eased((t - wait / 2.0) / (1.0 - wait))


def _eased(share: float) -> float:
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def _held_sideways(angles_deg: Array) -> Array:
    """Fingers drawn together as their knuckles bend, where the hard limit would snap them."""
    held = angles_deg.copy()
    for finger in FINGERS:
        bend = held[ANGLE_INDEX[f"{finger}_mcp_flex"]]
        room = max(0.0, FLEXED_MCP_DEG - bend) * EASED_DEG_PER_DEG
        most = FLEXED_MCP_ABDUCTION_DEG + room
        row = ANGLE_INDEX[f"{finger}_mcp_abd"]
        held[row] = min(max(held[row], -most), most)
    return held


@cache
def _detours() -> dict[tuple[Pose, Pose], int]:
    source = resources.files("services.worker.scene").joinpath(DETOUR_FILE)
    with source.open("rb") as file, np.load(file, allow_pickle=False) as filed:
        table = filed["detours"]
        poses = [Pose(str(name)) for name in filed["poses"]]
    return {(a, b): int(table[i, j]) for i, a in enumerate(poses) for j, b in enumerate(poses)}
