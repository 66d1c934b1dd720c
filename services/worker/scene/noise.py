"""Joint noise as tendons allow it: no hand holds a pose to the degree."""

from dataclasses import dataclass

import numpy as np

from hi5_common.domain.vocabulary import Pose
from services.worker.hand.angles import ANGLE_INDEX, ANGLE_NAMES, JointAngles
from services.worker.hand.bones import FINGERS
from services.worker.hand.contact.overlap import RestSkin, Search, Skin, overlaps
from services.worker.hand.contact.wishes import TOUCHES
from services.worker.hand.model import HandModel
from services.worker.hand.pose import posed_bones
from services.worker.hand.rest import DIGITS
from services.worker.hand.skin import unpressed
from services.worker.scene.poses import within_limits
from services.worker.scene.types import Array

MCP_DEG, PIP_DEG, SIDEWAYS_DEG = 3.0, 4.0, 1.2
DIP_OF_PIP = 0.6
"""The end joint follows the middle one: both hang on the deep flexor."""
FINGER_COUPLING = np.array(
    [[1.0, 0.5, 0.3, 0.2], [0.5, 1.0, 0.6, 0.4], [0.3, 0.6, 1.0, 0.7], [0.2, 0.4, 0.7, 1.0]]
)
"""Correlation of the fingers' flexion: one muscle belly drives middle, ring and little finger."""
THUMB_DEG = {
    "thumb_cmc_azimuth": 2.5,
    "thumb_cmc_palmar_abd": 2.0,
    "thumb_cmc_pronation": 1.5,
    "thumb_mcp_flex": 2.5,
    "thumb_ip_flex": 3.0,
}
WRIST_DEG = {"wrist_flex": 2.5, "wrist_ulnar_dev": 1.5, "forearm_pronation": 3.0}
HELD = 0.06
"""Share of the noise left to a digit that holds on to something."""
AMOUNTS = (1.0, 0.5, 0.25)
DEEPER_M = 4e-4
"""Noise may squeeze flesh by this much more than the pose does, before soft contact."""
SEARCH = Search(inward_m=0.0035, radius_m=0.0055, aside_m=0.004, before_m=0.0)
_FACTOR = np.linalg.cholesky(FINGER_COUPLING)


@dataclass(frozen=True)
class Freedom:
    """Share 0..1 of the noise that each of the five digits (thumb first) is free to take."""

    digits: tuple[float, ...]


def freedom(source: Pose, target: Pose, t: float) -> Freedom:
    """Free digits move freely; those that touch something in the nearer pose hardly while they are
    near it, those that touch in both never.
    """
    loose = min(1.0, 4.0 * min(t, 1.0 - t))
    first, last = _touching(source), _touching(target)
    nearer = first if t < 0.5 else last
    held = HELD + (1.0 - HELD) * loose
    shares = dict.fromkeys(nearer, held) | dict.fromkeys(first & last, HELD)
    return Freedom(tuple(shares.get(digit, 1.0) for digit in DIGITS))


def _touching(pose: Pose) -> set[str]:
    """The digits that a pose brings into touch with something."""
    parts = (part for touch in TOUCHES.get(pose, ()) for part in (*touch.first, *touch.second))
    return {part.split("_")[0] for part in parts}


def with_noise(
    model: HandModel, angles: JointAngles, free: Freedom, rng: np.random.Generator
) -> JointAngles:
    """The angles with noise on every joint: inside the hard limits, hardly deeper than without.

    One draw; where it presses flesh into flesh it is taken smaller, at last not at all. The number
    of values taken from `rng` does not depend on the outcome.
    """
    base = angles.as_array()
    noise = drawn_noise_deg(free, rng)
    most_m = None
    for amount in AMOUNTS:
        noisy = within_limits(base + amount * noise)
        depth_m = _depth_m(model, noisy)
        if depth_m <= DEEPER_M:
            return noisy
        most_m = _depth_m(model, angles) + DEEPER_M if most_m is None else most_m
        if depth_m <= most_m:
            return noisy
    wrist = np.array([name in WRIST_DEG for name in ANGLE_NAMES])
    return within_limits(base + wrist * noise)


def drawn_noise_deg(free: Freedom, rng: np.random.Generator) -> Array:
    """(26,) degrees of noise, coupled: DIP with PIP, neighbouring fingers with each other."""
    thumb, *fingers = free.digits
    knuckles = np.einsum("ij,j->i", _FACTOR, rng.standard_normal(4)) * MCP_DEG
    middles = np.einsum("ij,j->i", _FACTOR, rng.standard_normal(4)) * PIP_DEG
    sideways = rng.standard_normal(4) * SIDEWAYS_DEG
    ends = DIP_OF_PIP * middles + rng.standard_normal(4)
    noise = np.zeros(len(ANGLE_NAMES))
    columns = {"mcp_flex": knuckles, "mcp_abd": sideways, "pip_flex": middles, "dip_flex": ends}
    for joint, values in columns.items():
        rows = [ANGLE_INDEX[f"{finger}_{joint}"] for finger in FINGERS]
        noise[rows] = np.clip(values, -12.0, 12.0) * np.array(fingers)
    for share, table in ((thumb, THUMB_DEG), (1.0, WRIST_DEG)):
        for name, spread in table.items():
            noise[ANGLE_INDEX[name]] = share * spread * np.clip(rng.standard_normal(), -2.5, 2.5)
    return noise


def _depth_m(model: HandModel, angles: JointAngles) -> float:
    """An estimate of how deep flesh overlaps before it is pressed, on the control mesh."""
    skin_m = unpressed(model, angles, posed_bones(model, angles))
    posed = Skin.of(skin_m, model.quads)
    rest = RestSkin.control(model)
    return float(
        overlaps(posed, rest, np.flatnonzero(~model.forearm), SEARCH).depth.max(initial=0.0)
    )
