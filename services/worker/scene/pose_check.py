"""Judges posed hands: limits, self-penetration, contacts, volume. It leans on no solver."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.angles import JointAngles
from services.worker.hand.contact.body import Body
from services.worker.hand.contact.measure import gap_m, self_penetration
from services.worker.hand.contact.wishes import TOUCHES
from services.worker.hand.family import HandFamily
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.hand.skin import posed_hand
from services.worker.hand.surface import triangles, volume_m3
from services.worker.scene.noise import freedom, with_noise
from services.worker.scene.path import between
from services.worker.scene.poses import solved_angles


@dataclass(frozen=True)
class Verdict:
    """What was measured of one posed hand. gap_mm: the widest of the gaps that should be none."""

    case: str
    limit_excess_deg: float
    depth_mm: float
    gap_mm: float
    volume_change: float


def judged(body: Body, angles: JointAngles, case: str, pose: Pose | None = None) -> Verdict:
    """Measure a hand as it would be rendered, its skin subdivided once; contacts if of a pose."""
    quads = body.fine.quads
    skin_m = body.fine.apply(posed_hand(body.model, angles).vertices_m)
    faces = triangles(quads)
    gaps = (
        [gap_m(skin_m, quads, *body.patches(touch)) for touch in TOUCHES.get(pose, ())]
        if pose
        else []
    )
    return Verdict(
        case,
        float(np.abs(hard_limit_excess_deg(angles)).max()),
        1000.0 * self_penetration(skin_m, quads).deepest_m,
        1000.0 * max(gaps, default=0.0),
        volume_m3(skin_m, faces) / volume_m3(body.rest.points, faces) - 1.0,
    )


def library_cases(poses: tuple[Pose, ...]) -> list[tuple[Gender, Pose, str, HandShape]]:
    """Every pose on the average hand and on every extreme of shape, of both genders."""
    shapes = (("average", HandShape.average()), *SHAPE_EXTREMES)
    return [
        (gender, pose, name, shape) for gender in Gender for pose in poses for name, shape in shapes
    ]


def judge_pose(
    family: HandFamily, gender: Gender, pose: Pose, shape_name: str, shape: HandShape
) -> Verdict:
    """A pose of the library, without noise."""
    angles = solved_angles(gender, pose, shape)
    return judged(_body(family, shape), angles, f"{pose} {gender} {shape_name}", pose)


@dataclass(frozen=True)
class Interpolation:
    """A drawn hand on its way between two poses."""

    gender: Gender
    source: Pose
    target: Pose
    t: float
    shape: HandShape


def drawn_interpolation(seed: int, index: int) -> Interpolation:
    """Any hand, any two poses, any place between, evenly."""
    rng = factor_rng(seed, index, "pose_audit")
    gender = list(Gender)[int(rng.integers(len(Gender)))]
    source, target = (list(Pose)[int(row)] for row in rng.choice(len(Pose), 2, replace=False))
    t = float(rng.uniform())
    ends = dict(SHAPE_EXTREMES)
    low, high = ends["all_low"], ends["all_high"]
    drawn = {
        name: float(rng.uniform(getattr(low, name), getattr(high, name)))
        for name in vars(HandShape.average())
    }
    return Interpolation(gender, source, target, t, replace(low, **drawn))


def judge_interpolation(family: HandFamily, drawn: Interpolation, seed: int, index: int) -> Verdict:
    """A hand between two poses, with the noise that an image's hand has."""
    body = _body(family, drawn.shape)
    angles = between(drawn.gender, drawn.shape, drawn.source, drawn.target, drawn.t)
    free = freedom(drawn.source, drawn.target, drawn.t)
    noisy = with_noise(body.model, angles, free, factor_rng(seed, index, "pose_noise"))
    case = f"{index}: {drawn.source}->{drawn.target} {drawn.t:.2f} {drawn.gender}"
    return judged(body, noisy, case)


@lru_cache(maxsize=32)
def _body(family: HandFamily, shape: HandShape) -> Body:
    return Body.of(family.shaped(shape))
