"""Nails: the plate on each digit, its lunula and free edge, and the folds of skin around it."""

from dataclasses import dataclass

import numpy as np

from hi5_common.domain.vocabulary import Gender
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
LUNULA_SHARE = {"thumb": 1.0, "index": 0.6, "middle": 0.5, "ring": 0.15, "pinky": 0.0}
"""How much of the half moon shows: most on the thumb, none on the little finger."""
RIDGE_MM = 0.035
SHORTER = {Gender.FEMALE: 0.0, Gender.MALE: 0.07}
"""Men cut their nails shorter: so much of half a nail's length less of it is free."""


@dataclass(frozen=True, eq=False)
class Nails:
    """Over texels (T,): plate and lunula 0..1; along, the way to the tip, -1 root to 1; relief, mm.

    The free edge begins where `along` passes what the individual's nails are cut to.
    """

    plate: F8
    along: F8
    lunula: F8
    relief_mm: F8


def nails_of(skin: Skin) -> Nails:
    """All five nails, each fitted to the nail of the mesh."""
    count = skin.texels.count
    plate, lunula, relief_mm = (np.zeros(count) for _ in range(3))
    on_nail = np.zeros(count)
    shorter = SHORTER[skin.model.gender]
    for digit, name in enumerate(DIGITS):
        rows, along, across, size_mm = _plate_coordinates(skin, digit, name)
        inside_mm, edge = _plate_edge_mm(along, across, size_mm)
        plate[rows] = smoothstep(-0.16, 0.16, inside_mm)
        lunula[rows] = _lunula(along, across, LUNULA_SHARE[name])
        # The edge is cut in a bow, a little less than the tip's own.
        on_nail[rows] = np.clip(along + 0.12 * across**2 - shorter, -1.0, 1.0)
        fold = bump(inside_mm, 0.3) * edge
        swell = bump(inside_mm + 0.9, 0.8) * edge
        dome = DOME_MM * (1.0 - np.clip(across, -1.0, 1.0) ** 2)
        relief_mm[rows] = plate[rows] * dome - 0.28 * fold + 0.16 * swell
        free = smoothstep(0.80, 0.92, along) * plate[rows]
        relief_mm[rows] += 0.10 * free
    return Nails(plate, on_nail, lunula, relief_mm)


def nail_ridges_mm(skin: Skin) -> F8:
    """Fine ridges along the nails (T,), mm; 0 away from them. They show in old age."""
    ridges_mm = np.zeros(skin.texels.count)
    for digit, name in enumerate(DIGITS):
        rows, along, across, _ = _plate_coordinates(skin, digit, name)
        for number, across_count, share in ((0, 9.0, 0.6), (1, 21.0, 0.4)):
            places = np.stack(
                [across * across_count, along * 0.7, np.full(len(rows), 3.7 * digit)], axis=1
            )
            ridges_mm[rows] += share * RIDGE_MM * value_noise(places, 1.0, f"nail/{number}")
    return ridges_mm


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


def _lunula(along: F8, across: F8, share: float) -> F8:
    reach = -0.98 + 0.42 * share
    moon = smoothstep(0.07, -0.07, along - reach + 0.75 * across**2) if share else 0.0 * along
    return np.asarray(moon * min(1.0, 0.3 + share))
