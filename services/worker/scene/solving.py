"""Solves the contacts of a pose for one hand: what the file of solved poses is made of."""

import numpy as np

from hi5_common.domain.vocabulary import Pose
from services.worker.hand.contact.body import Body
from services.worker.hand.contact.solver import Task, holds, preference_deg, solved
from services.worker.hand.contact.wishes import TOUCHES
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.scene.types import Array

SHAPES: tuple[tuple[str, HandShape], ...] = (("average", HandShape.average()), *SHAPE_EXTREMES)
"""The shapes every pose is solved for; between them its angles are interpolated."""
FIRST_STEPS, NEXT_STEPS = 30, 12


def solved_pose_deg(body: Body, pose: Pose, table_deg: Array, start_deg: Array | None) -> Array:
    """Angles (26,) of a pose for one hand, near the table's; start_deg: another hand's solution."""
    task = Task(table_deg, TOUCHES.get(pose, ()), preference_deg())
    if start_deg is not None and holds(body, task, start_deg):
        return start_deg
    steps = FIRST_STEPS if start_deg is None else NEXT_STEPS
    start = table_deg if start_deg is None else start_deg
    return np.round(solved(body, task, start, steps), 2)
