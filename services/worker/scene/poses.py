"""The library of 44 poses and the ways between them."""

import csv
from functools import cache
from importlib import resources

import numpy as np

from hi5_common.domain.vocabulary import Pose
from services.worker.hand.angles import ANGLE_NAMES, JointAngles
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.scene.types import PoseBlend


@cache
def pose_library() -> dict[Pose, JointAngles]:
    """Read poses.csv: absolute anatomical angles in degrees, one row a pose."""
    text = resources.files("services.worker.scene").joinpath("poses.csv").read_text("utf-8")
    return {
        Pose(row["pose"]): JointAngles(**{name: float(row[name]) for name in ANGLE_NAMES})
        for row in csv.DictReader(text.splitlines())
    }


def blended_angles(blend: PoseBlend) -> JointAngles:
    """Interpolate joint angles and hold them to the hard limits.

    Only a knuckle that bends past 60 degrees on the way, where its ligaments hold it sideways,
    ever needs holding: all other limits are a box, which an interpolation cannot leave.
    """
    library = pose_library()
    source, target = library[blend.source].as_array(), library[blend.target].as_array()
    between = JointAngles.from_array((1.0 - blend.t) * source + blend.t * target)
    return JointAngles.from_array(between.as_array() - hard_limit_excess_deg(between))


def draw_blend(pose: Pose, rng: np.random.Generator, most: float) -> PoseBlend:
    """Draw a way from `pose` towards another pose, at most the share `most` of it gone."""
    others = [other for other in Pose if other is not pose]
    target = others[int(rng.integers(len(others)))]
    return PoseBlend(pose, target, float(rng.uniform(0.0, most)))
