"""How the hand of an image is held: a pose on the way to another, moving or still, never exact."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hi5_common.domain.plan import Cell
from hi5_common.domain.vocabulary import Pose
from services.worker.hand.angles import JointAngles
from services.worker.hand.model import HandModel
from services.worker.hand.shape import HandShape
from services.worker.scene.motion import MOTIONS, moved
from services.worker.scene.noise import freedom, with_noise
from services.worker.scene.path import between, goes_round
from services.worker.scene.poses import draw_blend
from services.worker.scene.types import PoseBlend

MAX_BLEND = 0.25
"""A still is at least three quarters of the pose that it is counted as."""
MAX_BLEND_ROUND = 0.075
"""The same where the way goes round: there the hand is a sixth open already (path.RISE)."""


@dataclass(frozen=True)
class Posture:
    """What was drawn, and the joint angles that came of it. phase (0..1) is a motion's, or None."""

    blend: PoseBlend
    phase: float | None
    angles: JointAngles


def draw_posture(
    cell: Cell,
    shape: HandShape,
    model: HandModel,
    rng_of: Callable[[str], np.random.Generator],
    among: Sequence[Pose] = tuple(Pose),
) -> Posture:
    """Draw a way towards another pose of `among`, the moment of a motion, and the noise of every
    joint.
    """
    blend = _drawn_blend(cell.pose, rng_of("pose_blend"), among)
    angles = between(cell.gender, shape, blend.source, blend.target, blend.t)
    motion = MOTIONS.get(cell.pose)
    phase = None if motion is None else float(rng_of("motion_phase").uniform())
    if motion is not None and phase is not None:
        angles = moved(angles, motion, phase)
    free = freedom(blend.source, blend.target, blend.t)
    return Posture(blend, phase, with_noise(model, angles, free, rng_of("joint_noise")))


def _drawn_blend(pose: Pose, rng: np.random.Generator, among: Sequence[Pose]) -> PoseBlend:
    blend = draw_blend(pose, rng, MAX_BLEND, among)
    if goes_round(blend.source, blend.target):
        return replace(blend, t=blend.t * MAX_BLEND_ROUND / MAX_BLEND)
    return blend
