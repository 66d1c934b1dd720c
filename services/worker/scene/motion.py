"""The three motions: loopable sequences of keyframes over one period."""

from dataclasses import dataclass, replace

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.angles import JointAngles
from services.worker.hand.bones import FINGERS
from services.worker.hand.shape import HandShape
from services.worker.scene.poses import solved_angles, within_limits

Keys = tuple[float, ...]


@dataclass(frozen=True)
class Motion:
    """One period: offsets in degrees at evenly spaced phases, the first and last alike.

    Between keys the way is eased as half a sine. lag: share of a period by which the fingers'
    flexion (+-fingers_deg at the knuckles) comes after the wrist.
    """

    period_s: tuple[float, float]
    keys: dict[str, Keys]
    fingers_deg: float = 0.0
    lag: float = 0.0


MOTIONS: dict[Pose, Motion] = {
    Pose.RELAXED_WAVE: Motion(
        (0.5, 0.7),
        {
            "wrist_ulnar_dev": (0.0, -15.0, 0.0, 22.0, 0.0),
            "forearm_pronation": (0.0, -7.0, 0.0, 7.0, 0.0),
        },
        fingers_deg=4.0,
        lag=0.1,
    ),
    Pose.FIST_WAVE: Motion((0.5, 0.7), {"wrist_flex": (-20.0, 10.0, 35.0, 10.0, -20.0)}),
    Pose.PROM_WAVE: Motion(
        (1.4, 2.0),
        {
            "forearm_pronation": (0.0, -25.0, 0.0, 25.0, 0.0),
            "wrist_ulnar_dev": (0.0, -3.0, 0.0, 3.0, 0.0),
        },
    ),
}
"""After the table of motions in docs: wrist and forearm within their typical ranges."""


def motion_angles(gender: Gender, shape: HandShape, pose: Pose, phase: float) -> JointAngles:
    """The hand at a phase (any number, period 1) of its motion; KeyError for a pose that has none.

    Continuous, and the same at phase and phase + 1.
    """
    return moved(solved_angles(gender, pose, shape), MOTIONS[pose], phase)


def moved(angles: JointAngles, motion: Motion, phase: float) -> JointAngles:
    """Add a motion's offsets at a phase to angles at rest."""
    offsets = {name: keyed(keys, phase) for name, keys in motion.keys.items()}
    swing = motion.fingers_deg * float(np.sin(2.0 * np.pi * (phase - motion.lag)))
    if motion.fingers_deg:
        offsets |= {f"{finger}_mcp_flex": swing for finger in FINGERS}
    added = replace(angles, **{name: getattr(angles, name) + x for name, x in offsets.items()})
    return within_limits(added.as_array())


def keyed(keys: Keys, phase: float) -> float:
    """The value between evenly spaced keys at a phase, eased as half a cosine."""
    at = (phase % 1.0) * (len(keys) - 1)
    first = int(at)
    share = (1.0 - np.cos(np.pi * (at - first))) / 2.0
    return float((1.0 - share) * keys[first] + share * keys[first + 1])
