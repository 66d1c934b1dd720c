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

FREE = np.array([not name.startswith(("wrist", "forearm")) for name in ANGLE_NAMES])
"""The wrist and the forearm move no part of the hand against another."""
SEARCH = Search(inward_m=0.0045, radius_m=0.0075, aside_m=0.0042, before_m=0.0)
"""Among the vertices of the control mesh: the smooth skin lies a little inside it."""
SQUEEZE_M = 0.0014
"""Overlap of control meshes that soft contact takes up without a trace."""
PRESSURE_M = 0.0004
"""How deep skin that should touch is set into the other skin."""
SQUEEZE_SCALE = 0.35 / 0.0008
"""Each overlapping point counts little: a patch in contact has dozens."""
TOUCH_SCALE_M = 0.0003
BESIDE_M = 0.0012
MOST_STEP_DEG = 5.0
STEP_DEG = 0.25
SOLVED_COST, LEAST_GAIN, MOST_DAMPING = 1e-3, 1e-3, 1e3
OPEN_SLACK_DEG = {"mcp_flex": 6.0, "mcp_abd": 3.0, "pip_flex": 6.0, "dip_flex": 6.0}
CLOSED_SLACK_DEG = {"mcp_flex": 1.0, "mcp_abd": 6.0, "pip_flex": 6.0, "dip_flex": 12.0}
"""Knuckles stay in their line, by which a fist is known; the joints beyond them make room."""
CLOSED_MCP_DEG, CLOSED_PIP_DEG = 60.0, 70.0
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
    """Linear conditions on points: residual (N,), gradient taken at `point` minus `cover`.

    Points are rows of Body.all_points_m: control vertices first, then fine ones.
    """

    residual: F8
    point: I8
    cover: I8
    way: F8
    scale: F8


def preference_deg(table_deg: F8) -> F8:
    """(26,) how far each angle may leave the table's (26,) at equal cost."""
    slack = CLOSED_SLACK_DEG if _is_closed(table_deg) else OPEN_SLACK_DEG
    narrow = {"cmc4_flex": 3.0, "cmc5_flex": 3.0, "thumb_cmc_pronation": 5.0}
    return np.array(
        [
            slack[name.split("_", 1)[1]] if name.startswith(FINGERS) else narrow.get(name, 6.0)
            for name in ANGLE_NAMES
        ]
    )


def _is_closed(table_deg: F8) -> bool:
    """Whether a finger is closed into the palm."""
    return any(
        table_deg[ANGLE_INDEX[f"{finger}_mcp_flex"]] >= CLOSED_MCP_DEG
        and table_deg[ANGLE_INDEX[f"{finger}_pip_flex"]] >= CLOSED_PIP_DEG
        for finger in FINGERS
    )


def solved(body: Body, task: Task, start_deg: F8, steps: int) -> F8:
    """The best angles (26,) found in a number of trials from a start, inside the hard limits.

    Levenberg and Marquardt: a trial that makes matters worse is taken back and made shorter.
    """
    best = _State.of(body, task, _inside(start_deg))
    matrix, right = best.system(body)
    damping = 0.03
    for _ in range(steps):
        normal = np.einsum("ij,ik->jk", matrix, matrix)
        normal += damping * np.diag(np.diag(normal) + 0.05)
        step = np.linalg.solve(normal, -np.einsum("ij,i->j", matrix, right))
        angles = best.angles.copy()
        angles[FREE] += np.clip(step, -MOST_STEP_DEG, MOST_STEP_DEG)
        trial = _State.of(body, task, _inside(angles))
        if trial.cost < best.cost:
            gained = best.cost - trial.cost
            best, damping = trial, max(damping / 3.0, 1e-3)
            if best.cost < SOLVED_COST or gained < LEAST_GAIN:
                break
            matrix, right = best.system(body)
        elif (damping := damping * 4.0) > MOST_DAMPING:
            break
    return best.angles


@dataclass(frozen=True, eq=False)
class _State:
    """Angles with everything that is wrong with them."""

    angles: F8
    rows: "_Rows"
    personal: F8
    slope: F8

    @classmethod
    def of(cls, body: Body, task: Task, angles_deg: F8) -> "_State":
        rows = _conditions(body, task, angles_deg)
        return cls(angles_deg, rows, *_preferences(task, angles_deg))

    @property
    def cost(self) -> float:
        rows = self.rows
        return float(np.sum((rows.residual * rows.scale) ** 2) + np.sum(self.personal**2))

    def system(self, body: Body) -> tuple[F8, F8]:
        """The linear least squares problem about these angles."""
        matrix = np.concatenate([_jacobian(body, self.angles, self.rows), self.slope])
        return matrix, np.concatenate([self.rows.residual * self.rows.scale, self.personal])


def _inside(angles_deg: F8) -> F8:
    """The nearest angles that the hard limits allow."""
    boxed = np.clip(angles_deg, HARD_LIMITS_DEG[:, 0], HARD_LIMITS_DEG[:, 1])
    return boxed - hard_limit_excess_deg(JointAngles.from_array(boxed))


def _conditions(body: Body, task: Task, angles_deg: F8) -> _Rows:
    control_m = body.control_m(angles_deg)
    found = [_squeezed(body, Skin.of(control_m, body.model.quads))]
    if task.touches:
        skin = Skin.smooth(body.fine, control_m)
        found += [_apart(body, skin, touch) for touch in task.touches]
    names = ("residual", "point", "cover", "way", "scale")
    return _Rows(*(np.concatenate([getattr(rows, name) for rows in found]) for name in names))


def _squeezed(body: Body, skin: Skin) -> _Rows:
    """Overlap beyond what flesh takes up: the deepest cover of every point."""
    hand = np.flatnonzero(~body.model.forearm)
    pairs = overlaps(skin, body.rest_control, hand, SEARCH)
    order = np.lexsort((-pairs.depth, pairs.point))
    first = np.unique(pairs.point[order], return_index=True)[1]
    rows = order[first]
    point, cover = pairs.point[rows], pairs.cover[rows]
    beyond = pairs.depth[rows] - SQUEEZE_M
    keep = beyond > 0
    scale = np.full(int(keep.sum()), SQUEEZE_SCALE)
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
    # Points beside each other are apart although neither lies above the other's skin.
    if distance[i, j] ** 2 - gap[0] ** 2 > BESIDE_M**2:
        normal = way[i, j][None] / distance[i, j]
        gap = distance[i, j : j + 1]
    wanted = gap + PRESSURE_M
    scale = np.where(wanted > 0, 1.0 / TOUCH_SCALE_M, 0.0)
    count = len(body.model.vertices_m)
    return _Rows(-wanted, point + count, cover + count, normal, scale)


def _jacobian(body: Body, angles_deg: F8, rows: _Rows) -> F8:
    """(N, free angles) change of the scaled residuals per degree.

    Residuals are -(point - cover)·way up to constants; points move as linear blends of bones.
    """
    base = body.bones(angles_deg)
    columns = []
    ends = [
        (body.all_weights[rows_of], body.all_points_m[rows_of])
        for rows_of in (rows.point, rows.cover)
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
