"""Finger breadths: the mesh's fingers are tapered, human ones are broad at the joints and tips."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8, I4
from services.worker.hand.bones import BONE_INDEX
from services.worker.hand.growth import PHALANGES, finger_flesh
from services.worker.hand.maps import smoothstep
from services.worker.hand.rotation import unit
from services.worker.hand.surface import ray_hits, vertex_normals

NAIL_REACH_M = 0.025
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


@dataclass(frozen=True)
class NailRelief:
    """Heights in metres along the skin's normal, for a man's hand.

    plate: the middle of the nail, which the asset models as a dish; fold: its edge at the root and
    the sides; free_edge: its edge at the end; beyond: the fingertip's skin under the free edge.
    """

    plate: float = 0.0008
    fold: float = -0.0002
    free_edge: float = 0.0003
    beyond: float = -0.0002


def nail_shift_m(
    control_m: F8, quads: I4, nails: npt.NDArray[np.bool_], tails_m: F8, heads_m: F8
) -> F8:
    """Shift (V,3) that makes nails of the asset's dishes; bones (B,3) tell root from free edge."""
    relief = NailRelief()
    touched, edge = (np.zeros(len(control_m), dtype=np.bool_) for _ in range(2))
    touched[quads[nails]] = True
    edge[quads[~nails]] = True
    near = np.zeros(len(control_m), dtype=np.bool_)
    near[quads[touched[quads].any(axis=1)]] = True
    height_m = np.where(touched & ~edge, relief.plate, 0.0)
    for digit in PHALANGES:
        row = BONE_INDEX[f"{digit}_distal"]
        way = unit(tails_m[row] - heads_m[row])
        own = near & (np.linalg.norm(control_m - tails_m[row], axis=1) < NAIL_REACH_M)
        along = np.einsum("vk,k->v", control_m, way)
        plate = along[own & touched]
        share = (along - plate.min()) / np.ptp(plate)
        free = smoothstep(0.6, 0.95, share)
        rim = own & touched & edge
        height_m[rim] = (relief.fold + free * (relief.free_edge - relief.fold))[rim]
        skin = own & ~touched
        height_m[skin] = (relief.beyond * smoothstep(0.9, 1.05, share))[skin]
    shift: F8 = height_m[:, None] * vertex_normals(control_m, quads)
    return shift
