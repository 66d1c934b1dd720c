"""Solves the contacts of a pose for one hand: what the file of solved poses is made of."""

from dataclasses import replace

import numpy as np

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import Pose
from services.worker.hand.angles import ANGLE_NAMES
from services.worker.hand.bones import FINGERS
from services.worker.hand.contact.body import Body
from services.worker.hand.contact.measure import gap_m, self_penetration, winding_numbers
from services.worker.hand.contact.solver import FREE, Task, preference_deg, solved
from services.worker.hand.contact.wishes import TOUCHES
from services.worker.hand.model import I4
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.hand.skin import posed_hand
from services.worker.scene.poses import within_limits
from services.worker.scene.types import Array

SHAPES: tuple[tuple[str, HandShape], ...] = (("average", HandShape.average()), *SHAPE_EXTREMES)
"""The shapes every pose is solved for; between them its angles are interpolated."""
FIRST_STEPS, NEXT_STEPS = 30, 12


GOOD_M = 0.0011
"""Gaps and depths below this, as measured, end the search; the bound is 1.5 mm."""
COVER_M, BARE_M = 0.001, 0.0004
"""Points this far about every keypoint are to lie in flesh; each outside counts as so deep."""
STARTS, START_SPREAD_DEG = 9, 5.0
"""Fresh starts about the first, for hands that a descent does not bring to touch."""
LOOSER_A_TURN = 0.5
"""Each holds fingers less to the table than the one before: thick ones close to no tight fist."""
OF_FINGERS = np.array([name.startswith(FINGERS) for name in ANGLE_NAMES])


def solved_pose_deg(body: Body, pose: Pose, table_deg: Array, start_deg: Array | None) -> Array:
    """Angles (26,) of a pose for one hand, near the table's; start_deg: another hand's solution.

    The best of several descents by what measure.py finds of the posed hand.
    """
    task = Task(table_deg, TOUCHES.get(pose, ()), preference_deg(table_deg))
    first = table_deg if start_deg is None else start_deg
    best, least = first, measured_m(body, task, first) if start_deg is not None else np.inf
    for turn in range(1 + STARTS):
        if least < GOOD_M:
            break
        steps = FIRST_STEPS if start_deg is None or turn else NEXT_STEPS
        rng = factor_rng(0, turn, f"start/{pose}")
        spread = START_SPREAD_DEG * rng.standard_normal(len(first)) * FREE
        looser = replace(task, slack_deg=task.slack_deg * (1.0 + LOOSER_A_TURN * turn * OF_FINGERS))
        found = solved(body, looser, first + (spread if turn else 0.0), steps)
        if (worst := measured_m(body, task, found)) < least:
            best, least = found, worst
    return np.round(best, 2)


def measured_m(body: Body, task: Task, angles_deg: Array) -> float:
    """What is worst of the posed hand: self-penetration, a gap, or keypoints out of the flesh."""
    quads = body.fine.quads
    posed = posed_hand(body.model, within_limits(np.round(angles_deg, 2)))
    skin_m = body.fine.apply(posed.vertices_m)
    gaps = [gap_m(skin_m, quads, *body.patches(touch)) for touch in task.touches]
    depth = self_penetration(skin_m, quads).deepest_m
    return max([depth, *gaps, bareness_m(posed.keypoints_m, skin_m, quads)])


def bareness_m(keypoints_m: Array, skin_m: Array, quads: I4) -> float:
    """How far keypoints (21, 3) are from lying well inside the skin (W, 3): 0 when all do.

    Metres in name alone: BARE_M for each of the points about them that lies outside.
    """
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    about = COVER_M * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    points = (keypoints_m[:, None] + about).reshape(-1, 3)
    return BARE_M * int((winding_numbers(points, skin_m[faces]) < 1).sum())
