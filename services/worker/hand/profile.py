"""Finger breadths: the mesh's fingers are tapered, human ones are broad at the joints and tips."""

import numpy as np

from services.worker.hand.asset import F8, I4
from services.worker.hand.growth import PHALANGES, finger_flesh
from services.worker.hand.surface import ray_hits

REFERENCE_BREADTH_M = 0.0904
"""Breadth of the hand to which the table belongs."""
BREADTHS_MM: dict[str, tuple[float, ...]] = {
    "thumb": (22.5, 23.5, 21.0),
    "index": (20.6, 21.2, 19.4, 18.8, 17.2),
    "middle": (20.8, 21.4, 19.6, 18.8, 17.2),
    "ring": (19.4, 20.2, 18.4, 17.8, 16.4),
    "pinky": (17.0, 17.8, 16.0, 15.6, 14.6),
}
"""Breadth at the stations of a finger: first segment, PIP, middle segment, DIP, nail; of the thumb:
first segment, IP, nail. Joint breadths of men after Garrett 1971 and Greiner 1991, rounded; those
between them by eye."""
STATIONS: dict[str, tuple[float, ...]] = {"thumb": (0.5, 1.0, 1.5)} | dict.fromkeys(
    PHALANGES.keys() - {"thumb"}, (0.75, 1.0, 1.5, 2.0, 2.5)
)
"""Where these are on the digit's middle line, in segments."""


def at_stations(line_m: F8, places: tuple[float, ...]) -> F8:
    """Points (N,3) of the polyline line_m (K,3) at places in segments."""
    knots = np.arange(len(line_m), dtype=np.float64)
    return np.stack([np.interp(places, knots, line_m[:, k]) for k in range(3)], axis=1)


def breadths_m(points_m: F8, hinge: F8, vertices_m: F8, faces: I4) -> F8:
    """Breadth (N,) of a digit along its hinge through points (N,3) inside it."""
    sides = np.stack([hinge, -hinge])
    hits = [ray_hits(point, sides, vertices_m, faces)[:, 0].sum() for point in points_m]
    return np.array(hits)


def profile_shift_m(control_m: F8, weights: F8, digit: str, line_m: F8, ratios: F8) -> F8:
    """Shift (V,3) of the control mesh that multiplies a digit's girth by ratios at its stations."""
    flesh = finger_flesh(control_m, weights, digit, line_m)
    lengths = np.linalg.norm(np.diff(line_m, axis=0), axis=1)
    knots_m = np.interp(
        STATIONS[digit], np.arange(len(line_m)), np.concatenate([[0.0], np.cumsum(lengths)])
    )
    ratio = np.interp(flesh.along_m, knots_m, ratios)
    shift: F8 = (flesh.share * (ratio - 1.0))[:, None] * flesh.radial_m
    return shift
