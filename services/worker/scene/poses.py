"""The library of 44 poses: the table, and the angles at which a hand of any shape takes them."""

import csv
from collections.abc import Sequence
from functools import cache
from importlib import resources

import numpy as np

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.angles import ANGLE_NAMES, JointAngles
from services.worker.hand.limits import HARD_LIMITS_DEG, hard_limit_excess_deg
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.scene.types import Array, PoseBlend

SOLVED_FILE = "solved_poses.npz"
"""Written by benchmarks/solve_poses.py: int16 hundredths of a degree, (gender, pose, shape, 26)."""
_FACTORS = ("age_years", "weight", "muscle", "finger_length", "finger_thickness", "scale")


@cache
def pose_library() -> dict[Pose, JointAngles]:
    """Read poses.csv: absolute anatomical angles in degrees, one row a pose."""
    text = resources.files("services.worker.scene").joinpath("poses.csv").read_text("utf-8")
    return {
        Pose(row["pose"]): JointAngles(**{name: float(row[name]) for name in ANGLE_NAMES})
        for row in csv.DictReader(text.splitlines())
    }


def solved_angles(gender: Gender, pose: Pose, shape: HandShape) -> JointAngles:
    """The pose on this hand: what should touch touches, and flesh hardly overlaps.

    Solved at the average shape and at the shape's extremes, interpolated between them: each factor
    adds its own correction, and a hand at the end of all factors at once what is left over.
    """
    solved = _solved()[gender, pose]
    average = solved["average"]
    away = _away(shape)
    angles = average.copy()
    for factor, amount in away.items():
        end = "high" if amount > 0 else "low"
        angles += abs(amount) * (solved[f"{factor}_{end}"] - average)
    for corner, sign in (("all_low", -1.0), ("all_high", 1.0)):
        whole = min(max(0.0, sign * amount) for amount in away.values())
        ends = (solved[f"{factor}_{corner.removeprefix('all_')}"] - average for factor in away)
        angles += whole * (solved[corner] - average - sum(ends))
    return within_limits(angles)


def within_limits(angles_deg: Array) -> JointAngles:
    """The nearest angles (26,) that the hard limits allow."""
    boxed = np.clip(angles_deg, HARD_LIMITS_DEG[:, 0], HARD_LIMITS_DEG[:, 1])
    return JointAngles.from_array(boxed - hard_limit_excess_deg(JointAngles.from_array(boxed)))


def _away(shape: HandShape) -> dict[str, float]:
    """How far each factor is from the average, -1 at its low and 1 at its high end."""
    ends = dict(SHAPE_EXTREMES)
    average = HandShape.average()
    away = {}
    for factor in _FACTORS:
        value, middle = getattr(shape, factor), getattr(average, factor)
        end = "high" if value > middle else "low"
        span = abs(getattr(ends[f"{factor}_{end}"], factor) - middle)
        away[factor] = (value - middle) / span
    return away


@cache
def _solved() -> dict[tuple[Gender, Pose], dict[str, Array]]:
    source = resources.files("services.worker.scene").joinpath(SOLVED_FILE)
    with source.open("rb") as file, np.load(file, allow_pickle=False) as filed:
        angles = filed["centidegrees"].astype(np.float64) / 100.0
        genders = [Gender(str(name)) for name in filed["genders"]]
        poses = [Pose(str(name)) for name in filed["poses"]]
        shapes = [str(name) for name in filed["shapes"]]
    return {
        (gender, pose): dict(zip(shapes, angles[i, j], strict=True))
        for i, gender in enumerate(genders)
        for j, pose in enumerate(poses)
    }


def draw_blend(
    pose: Pose, rng: np.random.Generator, most: float, among: Sequence[Pose] = tuple(Pose)
) -> PoseBlend:
    """Draw a way from `pose` towards another of `among`, at most the share `most` of it gone.

    Where `pose` is alone it stays.
    """
    others = [other for other in among if other is not pose] or [pose]
    target = others[int(rng.integers(len(others)))]
    return PoseBlend(pose, target, float(rng.uniform(0.0, most)))
