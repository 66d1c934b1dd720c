"""Pigment over the hand: glabrous skin, blood, melanin, unevenness, veins and spots, at texels."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hi5_common.domain.seeding import factor_rng
from services.worker.hand.asset import F8
from services.worker.hand.maps import smoothstep
from services.worker.hand.skinmaps.anatomy import Skin, bump, dorsal_share, joints, near
from services.worker.hand.skinmaps.lines import (
    WRIST_VEINS,
    Curve,
    distance_mm,
    spread,
)

GLABROUS_BORDER = (-0.26, 0.42)
"""Cosine from the sides to the palmar way over which skin turns glabrous: 4 to 8 mm."""
TIP_BORDER = (0.40, 0.95)
WRIST_BORDER_MM = (-12.0, 16.0)
VEIN_WIDTH_MM = 1.7
SPOT_REACH_MM = 8.0


@dataclass(frozen=True)
class Spots:
    """Round spots: how many on the hand's skin, and their smallest and largest radius."""

    name: str
    count: int
    radius_mm: tuple[float, float]


FRECKLES = Spots("freckle", 320, (0.35, 0.95))
AGE_SPOTS = Spots("age_spot", 60, (0.9, 3.4))


def glabrous_map(skin: Skin) -> F8:
    """Share of glabrous skin 0..1: an uneven border along the sides, ragged at the wrist."""
    uneven = 0.10 * skin.noise(9.0, 3, "glabrous")
    palmar = smoothstep(*GLABROUS_BORDER, -skin.facing + uneven)
    tip = smoothstep(*TIP_BORDER, skin.tip + uneven) * (skin.digit >= 0)
    ragged_mm = 5.0 * skin.noise(14.0, 3, "glabrous/wrist")
    wrist = smoothstep(*WRIST_BORDER_MM, skin.points_mm[:, 1] + ragged_mm)
    share = np.maximum(palmar, tip) * wrist
    patchy = 1.0 + 0.10 * skin.noise(5.0, 3, "glabrous/patchy")
    return np.clip(0.88 * share * patchy, 0.0, 1.0)


def blood_map(skin: Skin) -> F8:
    """Redness about 0: knuckles, pads and fingertips above it, the hollow of the palm below."""
    red = np.zeros(skin.texels.count)
    for joint in joints(skin.model):
        reach_mm = 8.0 if joint.name == "mcp" else 5.5
        rows, local_mm = near(skin, joint, 3.0 * reach_mm)
        along, across = bump(local_mm[:, 0], reach_mm), bump(local_mm[:, 1], 9.0)
        red[rows] += 0.26 * along * across * dorsal_share(skin.facing[rows])
    red += 0.22 * palm_share(skin) * _pads(skin)
    red += 0.20 * smoothstep(0.1, 0.9, skin.tip) * (skin.digit >= 0)
    red += 0.10 * smoothstep(0.0, 0.5, skin.nail)
    return np.clip(2.0 * (red - 0.06), -1.0, 1.0)


def blotch_map(skin: Skin, field: str) -> F8:
    """Blotches of blood, -1..1, stronger in the palm; fields are independent of each other."""
    blotch = skin.noise(11.0, 3, f"blotch/{field}")
    speckle = skin.noise(2.6, 2, f"speckle/{field}")
    palm = palm_share(skin)
    return np.clip(2.0 * ((0.10 + 0.10 * palm) * blotch + (0.05 + 0.09 * palm) * speckle), -1, 1)


def palm_share(skin: Skin) -> F8:
    """(T,) palmar skin of hand and digits with a soft border."""
    return smoothstep(-0.1, 0.4, -skin.facing) * smoothstep(-8.0, 16.0, skin.points_mm[:, 1])


def _pads(skin: Skin) -> F8:
    """Pads of fingers, heads of the metacarpals, balls of thumb and little finger; 0 between."""
    pads = np.where(skin.digit >= 0, 0.35, -0.25)
    for joint in joints(skin.model):
        if joint.name == "mcp":
            rows, local_mm = near(skin, joint, 16.0)
            pads[rows] += 0.6 * bump(np.hypot(local_mm[:, 0], local_mm[:, 1]), 9.0)
    x, y = skin.points_mm[:, 0], skin.points_mm[:, 1]
    balls = smoothstep(10.0, 26.0, np.abs(x + 4.0)) * smoothstep(75.0, 30.0, y)
    return np.asarray(np.clip(pads + 0.8 * balls, -0.3, 1.0))


def melanin_map(skin: Skin) -> F8:
    """Pigment about 0: darker over the knuckles, paler on the inner forearm."""
    dark = np.zeros(skin.texels.count)
    for joint in joints(skin.model):
        weight, reach_mm = (0.16, 7.0) if joint.name == "mcp" else (0.30, 5.2)
        rows, local_mm = near(skin, joint, 2.8 * reach_mm)
        uneven = 1.0 + 0.35 * skin.noise(3.5, 1, "knuckle", rows)
        spread_mm = bump(local_mm[:, 0], reach_mm) * bump(local_mm[:, 1], 10.0)
        dark[rows] += weight * spread_mm * uneven * dorsal_share(skin.facing[rows])
    dark -= 0.16 * skin.forearm * smoothstep(-0.2, 0.7, -skin.facing)
    return np.clip(2.0 * (dark - 0.05), -1.0, 1.0)


def mottle_map(skin: Skin, field: str) -> F8:
    """Uneven pigment, -1..1, from centimetres to a millimetre; fields are independent."""
    mottle = skin.noise(16.0, 3, f"mottle/{field}")
    grain = skin.noise(3.2, 3, f"grain/{field}")
    return np.clip(2.0 * (0.10 * mottle + 0.13 * grain), -1.0, 1.0)


def vein_map(skin: Skin, dorsal: tuple[Curve, ...], field: str) -> F8:
    """Veins under the back of the hand and the inner wrist: 1 over the middle of a large one."""
    veins = np.zeros(skin.texels.count)
    for curves, side in ((dorsal, 1.0), (WRIST_VEINS, -1.0)):
        facing = smoothstep(0.25, 0.7, side * skin.facing)
        rows = np.flatnonzero((facing > 0.0) & (skin.digit == -1))
        warp = [skin.noise(22.0, 3, f"vein/{field}/{axis}", rows) for axis in "xy"]
        warped_mm = skin.points_mm[rows, :2] + 5.5 * np.stack(warp, axis=1)
        for curve in curves:
            veins[rows] = np.maximum(veins[rows], _vein(skin, curve, warped_mm) * facing[rows])
    uneven = 0.8 + 0.3 * skin.noise(14.0, 2, f"vein/{field}/depth")
    return np.clip(veins * uneven, 0.0, 1.0)


def _vein(skin: Skin, curve: Curve, points_mm: F8) -> F8:
    far_mm, share = distance_mm(points_mm, spread(skin.model, curve))
    ends = smoothstep(0.0, 0.15, share) * smoothstep(0.0, 0.12, 1.0 - share)
    return np.asarray(curve.strength * ends * bump(far_mm, VEIN_WIDTH_MM))


def spot_map(skin: Skin, kind: Spots, field: str) -> F8:
    """Spots scattered over hairy skin, each its own radius and strength, with uneven edges."""
    rng = factor_rng(0, 0, f"skin_spots/{kind.name}/{field}")
    hairy = (skin.facing > 0.0) & (skin.nail < 0.02)
    chance = np.where(hairy, skin.even_area_m2 * skin.detailed, 0.0) * (
        0.6 + 0.4 * (skin.digit == -1)
    )
    middle = rng.choice(skin.texels.count, kind.count, p=chance / chance.sum())
    low, high = kind.radius_mm
    radius_mm = low + (high - low) * rng.uniform(0.0, 1.0, kind.count) ** 2.5
    strength = rng.uniform(0.25, 1.0, kind.count)
    tree = cKDTree(skin.points_mm[middle])
    spots = np.zeros(skin.texels.count)
    rows = np.flatnonzero(hairy)
    reach_mm = 2.0 * high
    rows = rows[np.isfinite(tree.query(skin.points_mm[rows], distance_upper_bound=reach_mm)[0])]
    points_mm = skin.points_mm[rows]
    warp = [0.3 * skin.noise(1.4, 1, f"{kind.name}/{field}/{axis}", rows) for axis in "xyz"]
    far_mm, owner = tree.query(points_mm + np.stack(warp, axis=1) * high, k=3)
    edge = np.clip(far_mm / radius_mm[owner], 0.0, 2.0)
    spots[rows] = (strength[owner] * smoothstep(1.25, 0.45, edge)).max(axis=1)
    return spots
