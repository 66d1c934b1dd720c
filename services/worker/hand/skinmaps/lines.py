"""The lines of the palm and the veins of the back: curves through landmarks of the hand."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from services.worker.hand.asset import F8
from services.worker.hand.bones import BONE_INDEX
from services.worker.hand.model import HandModel
from services.worker.hand.skinmaps.anatomy import MM_PER_M

SAMPLES = 160
FAR_MM = 6.0


@dataclass(frozen=True)
class Curve:
    """A line on the hand: points (across, along) and how strong and wide it is.

    Across is 0 at the little finger's knuckle and 1 at the index finger's; along is 0 at the wrist
    and 1 at the knuckles.
    """

    points: tuple[tuple[float, float], ...]
    strength: float = 1.0
    width_mm: float = 0.5


HEART = Curve(((-0.30, 0.74), (0.05, 0.80), (0.45, 0.92), (0.72, 1.05), (0.80, 1.14)))
HEAD = Curve(((1.22, 0.80), (0.95, 0.82), (0.60, 0.73), (0.25, 0.62), (-0.05, 0.53)), 0.95)
LIFE = Curve(
    ((1.22, 0.80), (1.00, 0.76), (0.80, 0.60), (0.68, 0.40), (0.64, 0.20), (0.68, 0.05)), 1.0, 0.55
)
FATE = Curve(((0.52, 0.16), (0.48, 0.40), (0.50, 0.70), (0.56, 0.86)), 0.28, 0.4)
PALM_LINES = (
    HEART,
    HEAD,
    LIFE,
    FATE,
    Curve(((0.95, 0.60), (0.75, 0.52), (0.50, 0.50)), 0.22, 0.35),
    Curve(((0.30, 0.70), (0.32, 0.55), (0.28, 0.40)), 0.2, 0.35),
    Curve(((-0.25, 0.62), (0.02, 0.66)), 0.3, 0.35),
    Curve(((-0.22, 0.40), (0.10, 0.46)), 0.2, 0.35),
    Curve(((1.10, 0.55), (0.88, 0.34), (0.80, 0.16)), 0.3, 0.35),
    Curve(((1.18, 0.50), (1.00, 0.30), (0.92, 0.14)), 0.22, 0.35),
    Curve(((0.15, 0.95), (0.50, 1.04), (0.70, 1.00)), 0.2, 0.35),
)
WRIST_LINES = (
    Curve(((-0.10, -0.03), (0.50, 0.01), (1.05, -0.04)), 0.9, 0.5),
    Curve(((-0.10, -0.13), (0.50, -0.10), (1.00, -0.14)), 0.6, 0.5),
)
DORSAL_VEINS = (
    Curve(((0.18, 1.05), (0.17, 0.85), (0.30, 0.62), (0.34, 0.40), (0.22, 0.10), (0.10, -0.5))),
    Curve(((0.50, 1.05), (0.50, 0.82), (0.36, 0.66)), 0.8),
    Curve(((0.82, 1.05), (0.82, 0.86), (0.66, 0.64), (0.56, 0.40), (0.72, 0.10), (0.78, -0.6))),
    Curve(((0.34, 0.42), (0.44, 0.50), (0.58, 0.46)), 0.7),
    Curve(((0.50, 0.84), (0.60, 0.74), (0.72, 0.70)), 0.6),
    Curve(((1.35, 0.55), (1.10, 0.38), (0.86, 0.14), (0.92, -0.5)), 0.8),
    Curve(((-0.10, 0.80), (0.02, 0.55), (0.16, 0.32), (0.16, 0.05)), 0.6),
)
WRIST_VEINS = (
    Curve(((0.70, 0.06), (0.66, -0.3), (0.74, -0.8)), 0.8),
    Curve(((0.36, 0.02), (0.40, -0.4), (0.30, -0.9)), 0.7),
)


def spread(model: HandModel, curve: Curve) -> F8:
    """A curve as points (SAMPLES, 2) in the palm plane: x ulnar, y distal, mm."""
    head = {
        finger: model.bone_heads_m[BONE_INDEX[f"{finger}_proximal"], :2] * MM_PER_M
        for finger in ("index", "pinky")
    }
    at = np.array(curve.points)
    # The knuckles' line leans: along is measured up to it at every place across the hand.
    side = head["pinky"] + at[:, :1] * (head["index"] - head["pinky"])
    foot = side * np.array([0.62, 0.0])
    places = foot + at[:, 1:] * (side - foot)
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    return np.asarray(CubicSpline(steps, places)(np.linspace(0.0, steps[-1], SAMPLES)))


def distance_mm(points_mm: F8, curve_mm: F8) -> tuple[F8, F8]:
    """Distance (N,) to a curve in the palm plane, at most FAR_MM, and the share of its length.

    points_mm (N, 2) or (N, 3): the third coordinate is ignored.
    """
    far, row = cKDTree(curve_mm).query(points_mm[:, :2], distance_upper_bound=FAR_MM)
    return np.minimum(far, FAR_MM), np.minimum(row, len(curve_mm) - 1) / (len(curve_mm) - 1)
