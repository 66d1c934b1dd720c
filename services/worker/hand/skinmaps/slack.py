"""How slack the skin over each knuckle is: folded where the joint is straight, taut where bent."""

import numpy as np

from services.worker.hand.angles import ANGLE_INDEX, JointAngles
from services.worker.hand.asset import F8
from services.worker.hand.maps import smoothstep
from services.worker.hand.model import HandModel
from services.worker.hand.rest import DIGITS
from services.worker.hand.skinmaps.anatomy import MM_PER_M, joints

TAUT_DEG = {"mcp": 60.0, "pip": 65.0, "dip": 45.0, "ip": 55.0}
"""The flexion at which the last fold over a joint is pulled flat."""
REACH_MM = 16.0
TAUT_REST = 0.12
"""What is left of a fold where the skin is taut."""


def slack(model: HandModel, angles: JointAngles) -> F8:
    """(V,) 1 where the skin lies in folds as at rest, down to TAUT_REST over a bent joint."""
    flexion = angles.as_array()
    points_mm = model.vertices_m * MM_PER_M
    weight, total = np.full(len(points_mm), 1e-6), np.full(len(points_mm), 1e-6)
    for joint in joints(model):
        bent = flexion[ANGLE_INDEX[f"{DIGITS[joint.digit]}_{joint.name}_flex"]]
        loose = 1.0 - (1.0 - TAUT_REST) * float(smoothstep(5.0, TAUT_DEG[joint.name], bent))
        offset = points_mm - joint.centre_mm
        near = np.exp(-np.einsum("vi,vi->v", offset, offset) / REACH_MM**2)
        weight += near
        total += near * loose
    share: F8 = total / weight
    return share
