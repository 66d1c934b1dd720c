"""The three motions: loopable sequences of keyframes over one period."""

import math
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

    Between keys the way is smooth: at rest at a turning point alone. lag: share of a period by
    which the fingers' flexion (+-fingers_deg at the knuckles) comes after the wrist.
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
    """The value between evenly spaced keys of a loop at a phase, a cubic with a smooth speed.

    Zero slope at a turning point, elsewhere that of a spline whose neighbours turn: 3/2 of the mean
    of both sides, at most three times either, so that no key is overshot (Fritsch and Carlson 1980,
    "Monotone piecewise cubic interpolation").
    """
    loop = keys[:-1]
    at = (phase % 1.0) * len(loop)
    first = int(at)
    t = at - first
    low, high = keys[first], keys[first + 1]
    start, end = _slope(loop, first), _slope(loop, first + 1)
    bend = t * t * (3.0 - 2.0 * t)
    return low + (high - low) * bend + t * (1.0 - t) * (start * (1.0 - t) - end * t)


def _slope(loop: Keys, number: int) -> float:
    before, here, after = (loop[(number + step) % len(loop)] for step in (-1, 0, 1))
    rise, fall = here - before, after - here
    if rise * fall <= 0.0:
        return 0.0
    steepest = 3.0 * min(abs(rise), abs(fall))
    return math.copysign(min(0.75 * abs(rise + fall), steepest), rise)
