"""Nails: the plate on each digit, its lunula and free edge, and the folds of skin around it."""

from dataclasses import dataclass

import numpy as np

from services.worker.hand.asset import F8
from services.worker.hand.bones import BONE_INDEX
from services.worker.hand.maps import smoothstep
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit
from services.worker.hand.skinmaps.anatomy import Skin, bump
from services.worker.hand.skinmaps.noise import value_noise

REACH_MM = 16.0
DOME_MM = 0.55
"""A nail is rounder across than the mesh under it."""
LUNULA_SHARE = {"thumb": 1.0, "index": 0.75, "middle": 0.7, "ring": 0.5, "pinky": 0.0}
"""How much of the half moon shows: most on the thumb, none on the little finger."""


@dataclass(frozen=True, eq=False)
class Nails:
    """Over texels (T,): plate 0..1; zone 0 lunula, 0.5 bed, 1 free edge; relief in mm."""

    plate: F8
    zone: F8
    relief_mm: F8


def nails_of(skin: Skin) -> Nails:
    """All five nails, each fitted to the nail of the mesh."""
    count = skin.texels.count
    plate, zone, relief_mm = np.zeros(count), np.full(count, 0.5), np.zeros(count)
    for digit, name in enumerate(DIGITS):
        rows, along, across, size_mm = _plate_coordinates(skin, digit, name)
        inside_mm, edge = _plate_edge_mm(along, across, size_mm)
        plate[rows] = smoothstep(-0.16, 0.16, inside_mm)
        zone[rows] = _zone(along, across, LUNULA_SHARE[name])
        ridges = 0.012 * value_noise(
            np.stack([across * 26.0, along * 1.2, np.zeros(len(rows))], axis=1), 1.0, "nail/ridges"
        )
        fold = bump(inside_mm, 0.3) * edge
        swell = bump(inside_mm + 0.9, 0.8) * edge
        dome = DOME_MM * (1.0 - np.clip(across, -1.0, 1.0) ** 2)
        relief_mm[rows] = plate[rows] * (ridges + dome) - 0.28 * fold + 0.16 * swell
        free = smoothstep(0.80, 0.92, along) * plate[rows]
        relief_mm[rows] += 0.10 * free
    return Nails(plate, zone, relief_mm)


def _plate_coordinates(
    skin: Skin, digit: int, name: str
) -> tuple[np.ndarray, F8, F8, tuple[float, float]]:
    """Texels near a nail, their place on it (-1..1 along to the tip, -1..1 across), half sizes."""
    bone = BONE_INDEX[f"{name}_distal"]
    way = unit(skin.model.bone_tails_m[bone] - skin.model.bone_heads_m[bone])
    hinge = skin.model.hinges[digit]
    up = unit(np.cross(way, hinge))
    own = (skin.digit == digit) & (skin.nail > 0.5)
    middle_mm = skin.points_mm[own].mean(axis=0)
    offset = skin.points_mm - middle_mm
    rows = np.flatnonzero(
        (skin.digit == digit)
        & (np.einsum("ni,ni->n", offset, offset) < REACH_MM**2)
        & (np.einsum("ni,i->n", skin.normals, up) > -0.1)
    )
    on_nail = np.einsum("ni,ji->nj", offset[own], np.stack([way, np.cross(up, way)]))
    low, high = np.percentile(on_nail, [1.0, 99.0], axis=0)
    centre, half = (low + high) / 2.0, (high - low) / 2.0
    local = np.einsum("ni,ji->nj", offset[rows], np.stack([way, np.cross(up, way)])) - centre
    along, across = local[:, 0] / half[0], local[:, 1] / half[1]
    return rows, along, across, (float(half[0]), float(half[1]))


def _plate_edge_mm(along: F8, across: F8, size_mm: tuple[float, float]) -> tuple[F8, F8]:
    """Distance (M,) inside the plate's outline, mm; and 0..1 where skin folds over the edge.

    The outline is a superellipse: nearly straight sides, a rounder root, a free tip.
    """
    root = np.where(along < 0.0, 2.3, 2.6)
    radius = (np.abs(along / 1.04) ** root + np.abs(across / 1.02) ** 2.7) ** (1.0 / 2.5)
    inside_mm = (1.0 - radius) * min(size_mm)
    folded = smoothstep(0.95, 0.6, along)
    return inside_mm, folded


def _zone(along: F8, across: F8, lunula: float) -> F8:
    free = smoothstep(0.76, 0.88, along + 0.12 * across**2)
    reach = -0.98 + 0.42 * lunula
    moon = smoothstep(0.06, -0.06, along - reach + 0.75 * across**2) if lunula else 0.0 * along
    return np.asarray(0.5 + 0.5 * free - 0.5 * moon * min(1.0, 0.6 + lunula))
