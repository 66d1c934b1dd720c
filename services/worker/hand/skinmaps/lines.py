"""The lines of the palm and the veins of the back: curves through landmarks of the hand."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from services.worker.hand.asset import F8
from services.worker.hand.bones import BONE_INDEX
from services.worker.hand.maps import smoothstep
from services.worker.hand.model import HandModel
from services.worker.hand.skinmaps.anatomy import MM_PER_M

SAMPLES = 160
BRANCH_SAMPLES = 24
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


PALM_A = (
    Curve(((-0.30, 0.74), (0.05, 0.80), (0.45, 0.92), (0.72, 1.05), (0.80, 1.14)), 1.0, 0.42),
    Curve(((1.22, 0.81), (0.95, 0.83), (0.60, 0.74), (0.25, 0.62), (-0.02, 0.53)), 0.9, 0.40),
    Curve(
        (
            *((1.22, 0.81), (1.06, 0.78), (0.87, 0.66), (0.74, 0.48)),
            *((0.68, 0.30), (0.68, 0.14), (0.74, 0.03)),
        ),
        1.0,
        0.44,
    ),
)
"""Distal and proximal transverse crease, and the one round the ball of the thumb."""
PALM_B = (
    Curve(((-0.32, 0.66), (0.02, 0.76), (0.40, 0.86), (0.68, 0.93), (0.98, 0.99)), 0.95, 0.42),
    Curve(((1.20, 0.86), (0.92, 0.80), (0.58, 0.64), (0.30, 0.47), (0.16, 0.34)), 0.9, 0.40),
    Curve(
        (
            *((1.24, 0.76), (1.05, 0.74), (0.84, 0.60), (0.69, 0.42)),
            *((0.62, 0.26), (0.62, 0.12), (0.66, 0.02)),
        ),
        1.0,
        0.44,
    ),
)
PALM_FINE = (
    Curve(((0.52, 0.16), (0.48, 0.40), (0.50, 0.70), (0.56, 0.86)), 0.55, 0.30),
    Curve(((0.95, 0.60), (0.75, 0.52), (0.50, 0.50)), 0.5, 0.28),
    Curve(((0.30, 0.70), (0.32, 0.55), (0.28, 0.40)), 0.5, 0.28),
    Curve(((-0.25, 0.62), (0.02, 0.66)), 0.6, 0.28),
    Curve(((-0.22, 0.40), (0.10, 0.46)), 0.5, 0.28),
    Curve(((0.15, 0.95), (0.50, 1.04), (0.70, 1.00)), 0.5, 0.28),
    Curve(((0.10, 0.30), (0.30, 0.44), (0.42, 0.62)), 0.45, 0.26),
    Curve(((0.86, 0.94), (0.84, 0.80), (0.80, 0.66)), 0.4, 0.26),
    Curve(((0.16, 0.92), (0.14, 0.78), (0.20, 0.64)), 0.4, 0.26),
    Curve(((0.96, 0.52), (1.06, 0.40), (1.20, 0.34)), 0.35, 0.26),
    Curve(((0.84, 0.36), (0.98, 0.26), (1.12, 0.22)), 0.35, 0.26),
)
PALM_SETS = (PALM_A, PALM_B, PALM_FINE)
BRANCHES_OF_SET = (7, 7, 3)
"""Fine side branches to each line of a set."""
WRIST_LINES = (
    Curve(((-0.10, -0.03), (0.50, 0.01), (1.05, -0.04)), 0.9, 0.5),
    Curve(((-0.10, -0.13), (0.50, -0.10), (1.00, -0.14)), 0.6, 0.5),
)
_VEINS_A = (
    Curve(((0.18, 1.05), (0.17, 0.85), (0.30, 0.62), (0.34, 0.40), (0.22, 0.10), (0.10, -0.5))),
    Curve(((0.50, 1.05), (0.50, 0.82), (0.36, 0.66)), 0.8),
    Curve(((0.82, 1.05), (0.82, 0.86), (0.66, 0.64), (0.56, 0.40), (0.72, 0.10), (0.78, -0.6))),
    Curve(((0.34, 0.42), (0.44, 0.50), (0.58, 0.46)), 0.7),
    Curve(((0.50, 0.84), (0.60, 0.74), (0.72, 0.70)), 0.6),
    Curve(((1.35, 0.55), (1.10, 0.38), (0.86, 0.14), (0.92, -0.5)), 0.8),
    Curve(((-0.10, 0.80), (0.02, 0.55), (0.16, 0.32), (0.16, 0.05)), 0.6),
)
_VEINS_B = (
    Curve(((0.14, 1.04), (0.20, 0.84), (0.14, 0.60), (0.24, 0.34), (0.36, 0.08), (0.30, -0.6))),
    Curve(((0.52, 1.04), (0.54, 0.80), (0.66, 0.56), (0.62, 0.30), (0.70, 0.02), (0.62, -0.6))),
    Curve(((0.86, 1.02), (0.88, 0.80), (0.78, 0.64), (0.66, 0.55)), 0.8),
    Curve(((0.14, 0.60), (0.30, 0.66), (0.46, 0.62), (0.64, 0.58)), 0.65),
    Curve(((1.30, 0.48), (1.08, 0.28), (0.98, 0.06), (0.86, -0.5)), 0.85),
    Curve(((-0.12, 0.70), (0.00, 0.44), (0.08, 0.20), (0.22, -0.04)), 0.7),
    Curve(((0.62, 0.30), (0.78, 0.34), (0.94, 0.22)), 0.5),
)
DORSAL_TREES = (_VEINS_A, _VEINS_B)
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
    return _splined(steps / steps[-1], places, np.linspace(0.0, 1.0, SAMPLES))


def _splined(at: F8, places: F8, wanted: F8) -> F8:
    """The cubic spline without a knot next to its ends, at `wanted` (S,), through places (N,2).

    at (N,) rises from 0 to 1. Solved in truncated powers, for few points; scipy.interpolate would
    cost each process that compiles maps a second.
    """
    degree = min(3, len(at) - 1)

    def powers(t: F8) -> F8:
        plain = t[:, None] ** np.arange(degree + 1)
        return np.hstack([plain, np.maximum(t[:, None] - at[2:-2], 0.0) ** 3])

    coefficients = np.linalg.solve(powers(at), places)
    curve: F8 = np.einsum("sn,nk->sk", powers(wanted), coefficients)
    return curve


@dataclass(frozen=True, eq=False)
class Drawing:
    """Many curves as one set of points (P, 2) in the palm plane, mm, with what each carries."""

    places_mm: F8
    strength: F8
    width_mm: F8

    def nearest(self, points_mm: F8) -> tuple[F8, F8, F8]:
        """Distance (N,) from points (N, 2) to the drawing, at most FAR_MM; strength and width."""
        far_mm, row = cKDTree(self.places_mm).query(points_mm, distance_upper_bound=FAR_MM)
        row = np.minimum(row, len(self.places_mm) - 1)
        return np.minimum(far_mm, FAR_MM), self.strength[row], self.width_mm[row]


def drawing(
    model: HandModel, curves: tuple[Curve, ...], branches: int, rng: np.random.Generator
) -> Drawing:
    """Return curves that thin out at their ends, each with so many fine branches at its sides."""
    places, strengths, widths = [], [], []
    for curve in curves:
        line_mm = spread(model, curve)
        share = np.linspace(0.0, 1.0, SAMPLES)
        ends = smoothstep(0.0, 0.14, share) * smoothstep(0.0, 0.22, 1.0 - share)
        strands = [(line_mm, curve.strength * (0.25 + 0.75 * ends), curve.width_mm)]
        strands += [_branch(line_mm, curve, rng) for _ in range(branches)]
        for strand_mm, strength, width_mm in strands:
            places.append(strand_mm)
            strengths.append(strength)
            widths.append(np.full(len(strand_mm), width_mm))
    return Drawing(np.concatenate(places), np.concatenate(strengths), np.concatenate(widths))


def _branch(line_mm: F8, curve: Curve, rng: np.random.Generator) -> tuple[F8, F8, float]:
    """A short line that leaves another at a narrow angle and fades."""
    at = int(rng.integers(SAMPLES // 12, SAMPLES - SAMPLES // 12))
    way = line_mm[min(at + 2, SAMPLES - 1)] - line_mm[at - 2]
    way = way / np.linalg.norm(way) * rng.choice((-1.0, 1.0))
    angle = rng.choice((-1.0, 1.0)) * rng.uniform(0.25, 0.75)
    bend = rng.uniform(-0.5, 0.5)
    share = np.linspace(0.0, 1.0, BRANCH_SAMPLES)
    turned = angle + bend * share
    steps = np.stack(
        [
            np.cos(turned) * way[0] - np.sin(turned) * way[1],
            np.sin(turned) * way[0] + np.cos(turned) * way[1],
        ],
        axis=1,
    )
    length_mm = rng.uniform(3.5, 10.0)
    strand_mm = line_mm[at] + np.cumsum(steps, axis=0) * length_mm / BRANCH_SAMPLES
    strength = curve.strength * rng.uniform(0.2, 0.5) * (1.0 - share) ** 0.7
    return strand_mm, strength, 0.62 * curve.width_mm


def distance_mm(points_mm: F8, curve_mm: F8) -> tuple[F8, F8]:
    """Distance (N,) to a curve in the palm plane, at most FAR_MM, and the share of its length.

    points_mm (N, 2) or (N, 3): the third coordinate is ignored.
    """
    far, row = cKDTree(curve_mm).query(points_mm[:, :2], distance_upper_bound=FAR_MM)
    return np.minimum(far, FAR_MM), np.minimum(row, len(curve_mm) - 1) / (len(curve_mm) - 1)
