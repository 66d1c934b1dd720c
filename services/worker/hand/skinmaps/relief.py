"""Height of the skin over the smooth mesh, millimetres: folds, nails, tendons, fine pattern."""

import numpy as np
from scipy.spatial import cKDTree

from hi5_common.domain.seeding import factor_rng
from services.worker.hand.asset import F8
from services.worker.hand.bones import BONE_INDEX, FINGERS
from services.worker.hand.maps import smoothstep
from services.worker.hand.skinmaps.anatomy import MM_PER_M, Skin, bump, joints, near
from services.worker.hand.skinmaps.creases import Creases
from services.worker.hand.skinmaps.nails import Nails, nail_ridges_mm
from services.worker.hand.skinmaps.noise import value_noise

PATTERN_SPACING_MM = 1.05
PATTERN_DEPTH_MM = 0.11
RIDGE_PERIOD_MM = 0.5
RIDGE_DEPTH_MM = 0.045
RIDGES_FROM_PX = 2048
CREPE_FOLDS = (
    (19.0, 6.0, 4.0, 0.16, 0.26),
    (11.0, 3.0, 28.0, 0.15, 0.12),
    (11.0, 3.0, -31.0, 0.15, 0.12),
    (6.0, 1.8, 9.0, 0.18, 0.07),
)
"""Families of folds: how long, how far apart (mm), aslant (degrees), share grooved, depth (mm)."""
CREPE_ON_DIGITS = 0.7


def still_mm(skin: Skin, creases: Creases, nails: Nails) -> F8:
    """What stays whatever the pose: the creases of the digits, nails, unevenness."""
    lumps = 0.05 * skin.noise(6.0, 3, "lumps") * (1.0 - nails.plate)
    return creases.flexion_mm + nails.relief_mm + lumps


def pattern_mm(skin: Skin, nails: Nails, cells: F8) -> F8:
    """Fine lines: polygons on hairy skin; ridges on glabrous skin where texels can hold them."""
    palmar = smoothstep(-0.15, 0.25, -skin.facing) * smoothstep(-4.0, 8.0, skin.points_mm[:, 1])
    hairy = -PATTERN_DEPTH_MM * cells
    pores = 0.02 * skin.noise(1.6, 2, "pores")
    glabrous = _ridges_mm(skin) if skin.texels.side_px >= RIDGES_FROM_PX else pores
    pattern = (hairy * (1.0 - palmar) + glabrous * palmar) * (1.0 - nails.plate)
    return np.asarray(pattern + nail_ridges_mm(skin) * nails.plate)


def skin_cells(skin: Skin) -> F8:
    """(T,) 1 on the borders between cells of skin about a millimetre wide, 0 inside them."""
    rng = factor_rng(0, 0, "skin_cells")
    area_mm2 = float(skin.even_area_m2.sum()) * MM_PER_M**2
    chance = skin.even_area_m2 / skin.even_area_m2.sum()
    seeds = rng.choice(skin.texels.count, int(area_mm2 / PATTERN_SPACING_MM**2), p=chance)
    # Squeezed along the limb: cells are wider than long, as skin folds across a limb.
    squeeze = np.array([1.0, 1.35, 1.0])
    jitter = 0.25 * PATTERN_SPACING_MM * rng.standard_normal((len(seeds), 3))
    tree = cKDTree((skin.points_mm[seeds] + jitter) * squeeze)
    far_mm, _ = tree.query(skin.points_mm * squeeze, k=2)
    return bump(far_mm[:, 1] - far_mm[:, 0], 0.22)


def _ridges_mm(skin: Skin) -> F8:
    """Papillary ridges: whorls on the pulps, a warped flow over the palm."""
    warp = [skin.noise(12.0, 2, f"ridge/{axis}") for axis in "xyz"]
    flow_mm = skin.points_mm + 3.0 * np.stack(warp, axis=1)
    phase_mm = 0.8 * flow_mm[:, 1] + 0.6 * flow_mm[:, 0]
    for joint in joints(skin.model):
        rows, local_mm = near(skin, joint, 34.0)
        own = skin.digit[rows] == joint.digit
        phase_mm[rows[own]] = local_mm[own, 0] + 1.2 * warp[0][rows[own]]
    for digit, finger in enumerate(("thumb", *FINGERS)):
        bone = BONE_INDEX[f"{finger}_distal"]
        head_mm, tail_mm = (
            ends[bone] * MM_PER_M for ends in (skin.model.bone_heads_m, skin.model.bone_tails_m)
        )
        core_mm = head_mm + 0.62 * (tail_mm - head_mm)
        rows = np.flatnonzero(skin.digit == digit)
        offset = skin.points_mm[rows] - core_mm
        way = (tail_mm - head_mm) / np.linalg.norm(tail_mm - head_mm)
        along = np.einsum("ni,i->n", offset, way)
        radius = np.sqrt(np.einsum("ni,ni->n", offset, offset) + 0.35 * along**2)
        distal = smoothstep(-6.0, -3.0, along)
        phase_mm[rows] += distal * (radius + 0.8 * warp[1][rows] - phase_mm[rows])
    waves = np.cos(2.0 * np.pi * phase_mm / RIDGE_PERIOD_MM)
    return np.asarray(RIDGE_DEPTH_MM * waves * (0.8 + 0.2 * value_noise(flow_mm, 0.9, "ridge")))


def tendons_mm(skin: Skin) -> F8:
    """Extensor tendons, fanning out to the knuckles: 1 mm over the middle of one."""
    tendons = np.zeros(skin.texels.count)
    rows = np.flatnonzero((skin.facing > 0.2) & (skin.digit == -1))
    points_mm = skin.points_mm[rows]
    for finger in FINGERS:
        knuckle = skin.model.bone_heads_m[BONE_INDEX[f"{finger}_proximal"]] * MM_PER_M
        root = np.array([knuckle[0] * 0.22 - 1.0, 2.0])
        share = np.clip((points_mm[:, 1] - root[1]) / (knuckle[1] - root[1]), 0.0, 1.0)
        middle = root[0] + share * (knuckle[0] - root[0])
        cord = bump(points_mm[:, 0] - middle, 1.9) * smoothstep(0.15, 0.55, share)
        tendons[rows] = np.maximum(tendons[rows], cord)
    return np.asarray(tendons * smoothstep(0.2, 0.7, skin.facing))


def crepe_mm(skin: Skin) -> F8:
    """Folds of thin, loose skin on the back of hand and wrist (T,), mm, as in great age.

    Lines lie where noise, stretched across the limb and aslant, passes zero: they branch, end and
    cross as skin's do. Wide folds, finer ones, and the crosshatch between them.
    """
    rows = np.flatnonzero(skin.facing > -0.15)
    points_mm = skin.points_mm[rows]
    warp = np.stack([skin.noise(17.0, 2, f"crepe/{axis}", rows) for axis in "xyz"], axis=1)
    folds_mm = np.zeros(len(rows))
    for number, (length_mm, apart_mm, slant_deg, groove, depth_mm) in enumerate(CREPE_FOLDS):
        turn = np.radians(slant_deg)
        across = np.cos(turn) * points_mm[:, 0] + np.sin(turn) * points_mm[:, 1]
        along = np.cos(turn) * points_mm[:, 1] - np.sin(turn) * points_mm[:, 0]
        places = np.stack([across / length_mm, along / apart_mm, points_mm[:, 2] / length_mm], 1)
        waves = np.asarray(
            value_noise(places + warp * 0.9, 1.0, f"crepe/{number}"), dtype=np.float64
        )
        folds_mm -= depth_mm * (bump(waves, groove) - 0.35)
    here = smoothstep(-0.1, 0.35, skin.facing[rows]) * (1.0 - skin.nail[rows])
    here *= np.where(skin.digit[rows] >= 0, CREPE_ON_DIGITS, 1.0)
    folds_mm *= here * (1.0 - 0.5 * skin.forearm[rows])
    crepe = np.zeros(skin.texels.count)
    crepe[rows] = folds_mm
    return crepe
