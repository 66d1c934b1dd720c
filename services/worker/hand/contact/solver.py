"""Joint angles at which flesh touches where it should and hardly overlaps.

Damped least squares over the angles of the digits, near the angles of the pose table. It runs when
the library of poses is compiled. Its depths are estimates between nearby points (overlap.py); what
it reaches is judged by measure.py, which it does not use.
"""

from dataclasses import dataclass

import numpy as np

from services.worker.hand.angles import ANGLE_INDEX, ANGLE_NAMES, JointAngles
from services.worker.hand.bones import FINGERS
from services.worker.hand.contact.body import Body
from services.worker.hand.contact.overlap import I8, Search, Skin, overlaps
from services.worker.hand.contact.wishes import Touch
from services.worker.hand.limits import HARD_LIMITS_DEG, hard_limit_excess_deg
from services.worker.hand.model import F8
from services.worker.hand.parts import HandPart

FREE = np.array([not name.startswith(("wrist", "forearm")) for name in ANGLE_NAMES])
"""The wrist and the forearm move no part of the hand against another."""
SEARCH = Search(inward_m=0.0045, radius_m=0.0065, aside_m=0.0028, before_m=0.0)
SQUEEZE_M = 0.0008
"""Overlap of different parts that soft contact takes up without a trace."""
PRESSURE_M = 0.0004
"""How deep skin that should touch is set into the other skin."""
DEPTH_SCALE_M = 0.0008
TOUCH_SCALE_M = 0.0003
MOST_STEP_DEG = 5.0
STEP_DEG = 0.25
ENOUGH = 0.98
PATIENCE = 3
SOLVED_COST = 1e-3
COUPLING_DEG = 6.0
DIP_SHARE = (0.4, 0.8)


@dataclass(frozen=True, eq=False)
class Task:
    """A pose to be solved: the table's angles (26,) in degrees and what is to touch."""

    angles_deg: F8
    touches: tuple[Touch, ...]
    slack_deg: F8
    """(26,) how dear it is to leave the table: one such step costs one unit."""


@dataclass(frozen=True, eq=False)
class _Rows:
    """Linear conditions on points: residual (N,), gradient taken at `point` minus `cover`."""

    residual: F8
    point: I8
    cover: I8
    way: F8
    scale: F8


def preference_deg() -> F8:
    """(26,) how far each angle may leave the table at equal cost."""
    narrow = {"cmc4_flex": 3.0, "cmc5_flex": 3.0, "thumb_cmc_pronation": 5.0}
    return np.array(
        [3.0 if name.endswith("mcp_abd") else narrow.get(name, 6.0) for name in ANGLE_NAMES]
    )


def solved(body: Body, task: Task, start_deg: F8, steps: int) -> F8:
    """The best angles (26,) found in a number of steps from a start, inside the hard limits."""
    angles = _inside(start_deg)
    best, best_cost, damping, idle = angles, np.inf, 0.3, 0
    for _ in range(steps):
        rows = _conditions(body, task, angles)
        personal, slope = _preferences(task, angles)
        cost = float(np.sum((rows.residual * rows.scale) ** 2) + np.sum(personal**2))
        idle = 0 if cost < ENOUGH * best_cost else idle + 1
        if cost < best_cost:
            best, best_cost, damping = angles, cost, max(damping / 1.5, 0.1)
        else:
            damping = min(damping * 2.0, 10.0)
        if idle > PATIENCE or cost < SOLVED_COST:
            break
        matrix = np.concatenate([_jacobian(body, angles, rows), slope])
        right = np.concatenate([rows.residual * rows.scale, personal])
        normal = np.einsum("ij,ik->jk", matrix, matrix)
        pull = np.einsum("ij,i->j", matrix, right)
        step = np.linalg.solve(normal + damping * 0.05 * np.eye(len(pull)), -pull)
        angles = angles.copy()
        angles[FREE] += np.clip(step, -MOST_STEP_DEG, MOST_STEP_DEG)
        angles = _inside(angles)
    return best


def _inside(angles_deg: F8) -> F8:
    """The nearest angles that the hard limits allow."""
    boxed = np.clip(angles_deg, HARD_LIMITS_DEG[:, 0], HARD_LIMITS_DEG[:, 1])
    return boxed - hard_limit_excess_deg(JointAngles.from_array(boxed))


def _conditions(body: Body, task: Task, angles_deg: F8) -> _Rows:
    skin = Skin.smooth(body.fine, body.control_m(angles_deg))
    found = [_squeezed(body, skin), *(_apart(body, skin, touch) for touch in task.touches)]
    names = ("residual", "point", "cover", "way", "scale")
    return _Rows(*(np.concatenate([getattr(rows, name) for rows in found]) for name in names))


def _squeezed(body: Body, skin: Skin) -> _Rows:
    """Overlap beyond what flesh takes up: the deepest cover of every point."""
    hand = np.flatnonzero(~body.of_parts((HandPart.FOREARM,)))
    pairs = overlaps(skin, body.rest, hand, SEARCH)
    order = np.lexsort((-pairs.depth, pairs.point))
    first = np.unique(pairs.point[order], return_index=True)[1]
    rows = order[first]
    point, cover = pairs.point[rows], pairs.cover[rows]
    beyond = pairs.depth[rows] - SQUEEZE_M
    keep = beyond > 0
    scale = np.full(int(keep.sum()), 0.35 / DEPTH_SCALE_M)
    return _Rows(beyond[keep], point[keep], cover[keep], pairs.normal[rows][keep], scale)


def _apart(body: Body, skin: Skin, touch: Touch) -> _Rows:
    """The nearest two points of patches that should touch, when there is air between them."""
    first, second = (np.flatnonzero(patch) for patch in body.patches(touch))
    way = skin.points[first][:, None] - skin.points[second][None]
    distance = np.sqrt(np.einsum("abk,abk->ab", way, way))
    i, j = np.unravel_index(np.argmin(distance), distance.shape)
    point, cover = first[i : i + 1], second[j : j + 1]
    normal = skin.normals[cover] - skin.normals[point]
    normal = normal / (np.linalg.norm(normal, axis=1, keepdims=True) + 1e-9)
    gap = np.einsum("pk,pk->p", skin.points[point] - skin.points[cover], normal)
    if distance[i, j] > 0.004:
        normal = way[i, j][None] / distance[i, j]
        gap = distance[i, j : j + 1]
    wanted = gap + PRESSURE_M
    scale = np.where(wanted > 0, 1.0 / TOUCH_SCALE_M, 0.0)
    return _Rows(-wanted, point, cover, normal, scale)


def _jacobian(body: Body, angles_deg: F8, rows: _Rows) -> F8:
    """(N, free angles) change of the scaled residuals per degree.

    Residuals are -(point - cover)·way up to constants; points move as linear blends of bones.
    """
    base = body.bones(angles_deg)
    columns = []
    ends = [
        (body.weights[rows_of], body.rest.points[rows_of]) for rows_of in (rows.point, rows.cover)
    ]
    for k in np.flatnonzero(FREE):
        moved = angles_deg.copy()
        moved[k] += STEP_DEG
        change = (body.bones(moved) - base) / STEP_DEG
        point, cover = (_blended(weights, points, change) for weights, points in ends)
        columns.append(-np.einsum("pk,pk->p", point - cover, rows.way) * rows.scale)
    return np.stack(columns, axis=1)


def _blended(weights: F8, points: F8, change: F8) -> F8:
    blend = np.einsum("pb,bij->pij", weights, change[:, :3])
    moved: F8 = np.einsum("pij,pj->pi", blend[:, :, :3], points) + blend[:, :, 3]
    return moved


def _preferences(task: Task, angles_deg: F8) -> tuple[F8, F8]:
    """Closeness to the table and the tendons' coupling, with slopes by free angle."""
    away = ((angles_deg - task.angles_deg) / task.slack_deg)[FREE]
    slope = np.diag(1.0 / task.slack_deg)[np.ix_(FREE, FREE)]
    column = {name: k for k, name in enumerate(np.array(ANGLE_NAMES)[FREE])}
    coupled, coupled_slope = [], []
    for finger in FINGERS:
        pip, dip = f"{finger}_pip_flex", f"{finger}_dip_flex"
        bend, end = angles_deg[ANGLE_INDEX[pip]], angles_deg[ANGLE_INDEX[dip]]
        share = np.clip(end / max(bend, 20.0), *DIP_SHARE)
        row = np.zeros(len(away))
        if bend > 20.0:
            row[column[dip]], row[column[pip]] = 1.0 / COUPLING_DEG, -share / COUPLING_DEG
            coupled.append((end - share * bend) / COUPLING_DEG)
            coupled_slope.append(row)
    if not coupled:
        return away, slope
    return np.concatenate([away, coupled]), np.concatenate([slope, np.stack(coupled_slope)])
