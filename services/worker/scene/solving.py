"""Solves the contacts of a pose for one hand: what the file of solved poses is made of."""

import numpy as np

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import Pose
from services.worker.hand.contact.body import Body
from services.worker.hand.contact.measure import gap_m, self_penetration
from services.worker.hand.contact.solver import FREE, Task, preference_deg, solved
from services.worker.hand.contact.wishes import TOUCHES
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.hand.skin import posed_hand
from services.worker.scene.poses import within_limits
from services.worker.scene.types import Array

SHAPES: tuple[tuple[str, HandShape], ...] = (("average", HandShape.average()), *SHAPE_EXTREMES)
"""The shapes every pose is solved for; between them its angles are interpolated."""
FIRST_STEPS, NEXT_STEPS = 30, 12


GOOD_M = 0.0009
"""Gaps and depths below this, as measured, end the search; the bound is 1.5 mm."""
STARTS, START_SPREAD_DEG = 6, 5.0
"""Fresh starts about the first, for hands that a descent does not bring to touch."""


def solved_pose_deg(body: Body, pose: Pose, table_deg: Array, start_deg: Array | None) -> Array:
    """Angles (26,) of a pose for one hand, near the table's; start_deg: another hand's solution.

    The best of several descents by what measure.py finds of the posed hand.
    """
    task = Task(table_deg, TOUCHES.get(pose, ()), preference_deg())
    first = table_deg if start_deg is None else start_deg
    best, least = first, measured_m(body, task, first) if start_deg is not None else np.inf
    for turn in range(1 + STARTS):
        if least < GOOD_M:
            break
        steps = FIRST_STEPS if start_deg is None or turn else NEXT_STEPS
        rng = factor_rng(0, turn, f"start/{pose}")
        spread = START_SPREAD_DEG * rng.standard_normal(len(first)) * FREE
        found = solved(body, task, first + (spread if turn else 0.0), steps)
        if (worst := measured_m(body, task, found)) < least:
            best, least = found, worst
    return np.round(best, 2)


def measured_m(body: Body, task: Task, angles_deg: Array) -> float:
    """The deepest self-penetration or the widest gap of the posed hand, whichever is worse."""
    quads = body.fine.quads
    angles = within_limits(np.round(angles_deg, 2))
    skin_m = body.fine.apply(posed_hand(body.model, angles).vertices_m)
    gaps = [gap_m(skin_m, quads, *body.patches(touch)) for touch in task.touches]
    return max([self_penetration(skin_m, quads).deepest_m, *gaps])
