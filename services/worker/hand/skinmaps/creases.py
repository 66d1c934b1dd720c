"""Folds: the lines of the palm, the creases that digits bend in, the wrinkles over knuckles."""

from dataclasses import dataclass

import numpy as np

from hi5_common.domain.seeding import factor_rng
from services.worker.hand.asset import F8
from services.worker.hand.maps import smoothstep
from services.worker.hand.skinmaps.anatomy import (
    Joint,
    Skin,
    bump,
    dorsal_share,
    joints,
    near,
    palmar_share,
)
from services.worker.hand.skinmaps.lines import (
    BRANCHES_OF_SET,
    PALM_SETS,
    WRIST_LINES,
    Drawing,
    drawing,
)

THUMB = 0
PALM_FROM_MM = -45.0
LINE_WARP_MM = 1.3
PALM_LINE_MM = 0.42
FOLD_REACH_MM = 5.0


@dataclass(frozen=True)
class Wrinkles:
    """Dorsal folds over a joint: how far apart, how far they reach, how deep, how curved."""

    spacing_mm: float
    reach_mm: float
    depth_mm: float
    oval: float


KNUCKLE_WRINKLES = {
    "mcp": Wrinkles(2.3, 7.0, 0.10, 0.2),
    "pip": Wrinkles(1.75, 5.6, 0.34, 0.5),
    "dip": Wrinkles(1.25, 2.9, 0.22, 0.3),
    "ip": Wrinkles(1.6, 4.4, 0.34, 0.4),
}
FLEXION_CREASES_MM = {
    "mcp": (),
    "pip": (-1.3, 1.1),
    "dip": (-0.8,),
    "ip": (-1.4, 0.9),
}
"""Where the palmar creases of a joint cross the digit, from the joint towards the tip."""
DIGIT_ROOT_SHARE = 0.47
"""The crease at the root of a finger lies so far along its first phalanx, at the web."""


@dataclass(frozen=True, eq=False)
class Creases:
    """Folds over texels (T,): 0..1 in three sets of palm lines and in the creases of digits and
    wrist; depths of those creases and of the dorsal wrinkles in mm, negative.
    """

    palm: tuple[F8, F8, F8]
    flexion: F8
    flexion_mm: F8
    dorsal_mm: F8


def creases_of(skin: Skin) -> Creases:
    """All folds of a hand; they are lines a third of a millimetre wide with soft shoulders."""
    flexion, flexion_mm, dorsal_mm = (np.zeros(skin.texels.count) for _ in range(3))
    _draw_wrist(skin, flexion, flexion_mm)
    found = joints(skin.model)
    for joint in found:
        for number, place_mm in enumerate(_places_mm(joint, found)):
            _draw_flexion(skin, joint, place_mm, number, flexion, flexion_mm)
        _draw_wrinkles(skin, joint, dorsal_mm)
    palm_a, palm_b, fine = (_palm_lines(skin, number) for number in range(len(PALM_SETS)))
    return Creases((palm_a, palm_b, fine), np.clip(flexion, 0.0, 1.0), flexion_mm, dorsal_mm)


def _places_mm(joint: Joint, found: tuple[Joint, ...]) -> tuple[float, ...]:
    if joint.name != "mcp":
        return FLEXION_CREASES_MM[joint.name]
    if joint.digit == THUMB:
        return (1.4,)
    following = next(j for j in found if j.digit == joint.digit and j.name == "pip")
    root_mm = DIGIT_ROOT_SHARE * float(np.linalg.norm(following.centre_mm - joint.centre_mm))
    return (root_mm - 0.9, root_mm + 0.8)


def _palm_lines(skin: Skin, number: int) -> F8:
    """One set of lines of the palm with their branches: 0..1 over texels (T,)."""
    rng = factor_rng(0, 0, f"palm_lines/{number}")
    lines = drawing(skin.model, PALM_SETS[number], BRANCHES_OF_SET[number], rng)
    return _drawn(skin, lines, f"line/{number}")


def _draw_wrist(skin: Skin, crease: F8, depth_mm: F8) -> None:
    wrist = drawing(skin.model, WRIST_LINES, 2, factor_rng(0, 0, "wrist_lines"))
    drawn = _drawn(skin, wrist, "wrist")
    np.maximum(crease, drawn, out=crease)
    np.minimum(depth_mm, -PALM_LINE_MM * drawn, out=depth_mm)


def _drawn(skin: Skin, lines: Drawing, name: str) -> F8:
    """A drawing on palmar skin, uneven in course, width and depth."""
    own = (skin.digit <= THUMB) & (skin.facing < 0.1) & (skin.points_mm[:, 1] > PALM_FROM_MM)
    rows = np.flatnonzero(own)
    warp = [skin.noise(9.0, 4, f"{name}/{axis}", rows) for axis in "xy"]
    places_mm = skin.points_mm[rows, :2] + LINE_WARP_MM * np.stack(warp, axis=1)
    far_mm, strength, width_mm = lines.nearest(places_mm)
    uneven = 0.82 + 0.30 * skin.noise(8.0, 2, f"{name}/depth", rows)
    beaded = 0.88 + 0.22 * skin.noise(2.4, 1, f"{name}/beads", rows)
    # A line is no thinner than a texel can show it.
    width_mm = np.maximum(width_mm * (0.85 + 0.3 * uneven), 0.6 * skin.texel_mm)
    line = 0.72 * bump(far_mm / width_mm, 1.0) + 0.28 * bump(far_mm / width_mm, 3.0)
    drawn = np.zeros(skin.texels.count)
    drawn[rows] = strength * uneven * beaded * palmar_share(skin.facing[rows]) * line
    return np.clip(drawn, 0.0, 1.0)


def _draw_flexion(
    skin: Skin, joint: Joint, place_mm: float, number: int, crease: F8, depth_mm: F8
) -> None:
    """Add one crease across the palmar side of a digit, thinning out towards its sides."""
    rows, local_mm = near(skin, joint, 30.0 if joint.name == "mcp" else 9.0)
    here = (np.abs(local_mm[:, 0] - place_mm) < FOLD_REACH_MM) & (skin.facing[rows] < 0.1)
    rows, local_mm = rows[here], local_mm[here]
    name = f"flexion/{joint.digit}/{joint.name}/{number}"
    warp_mm = 0.55 * skin.noise(6.0, 2, name, rows)
    bend_mm = 0.012 * local_mm[:, 1] ** 2 * (1.0 if number else -0.6)
    far_mm = np.abs(local_mm[:, 0] - place_mm + warp_mm + bend_mm)
    across = palmar_share(skin.facing[rows]) * (np.abs(local_mm[:, 1]) < 14.0)
    on_digit = (skin.digit[rows] == joint.digit) | (joint.name == "mcp")
    if joint.name == "mcp" and joint.digit == THUMB:
        # One soft crease at the root of the thumb, which does not run on over its ball.
        across = 0.6 * across * bump(local_mm[:, 1], 6.5)
    uneven = 0.8 + 0.35 * skin.noise(5.0, 2, f"{name}/depth", rows)
    strength = (0.9 - 0.3 * number) * across * on_digit * uneven
    _add_fold(rows, far_mm, 0.38, strength, 0.36, crease, depth_mm)
    for side, faint in ((-1.9, 0.3), (2.3, 0.35)):
        shift_mm = 0.7 * skin.noise(4.0, 2, f"{name}/{side}", rows)
        broken = smoothstep(-0.3, 0.5, skin.noise(4.0, 1, f"{name}/{side}/gap", rows))
        near_mm = np.abs(local_mm[:, 0] - place_mm - side + shift_mm)
        _add_fold(rows, near_mm, 0.28, strength * faint * broken, 0.22, crease, depth_mm)


def _add_fold(
    rows: np.ndarray,
    far_mm: F8,
    width_mm: float,
    strength: F8,
    depth: float,
    crease: F8,
    depth_mm: F8,
) -> None:
    core, shoulder = bump(far_mm, width_mm), bump(far_mm, 3.2 * width_mm)
    crease[rows] = np.maximum(crease[rows], strength * (0.75 * core + 0.25 * shoulder))
    fold_mm = -depth * strength * (0.6 * core + 0.4 * shoulder)
    depth_mm[rows] = np.minimum(depth_mm[rows], fold_mm)


def _draw_wrinkles(skin: Skin, joint: Joint, depth_mm: F8) -> None:
    """Add the folds over a knuckle: arcs that run together at its sides, like an eye."""
    style = KNUCKLE_WRINKLES[joint.name]
    rows, local_mm = near(skin, joint, 2.4 * style.reach_mm)
    rows, local_mm = rows[skin.facing[rows] > 0.0], local_mm[skin.facing[rows] > 0.0]
    name = f"wrinkle/{joint.digit}/{joint.name}"
    warp_mm = 0.75 * skin.noise(5.0, 3, name, rows)
    side_mm = np.clip(np.abs(local_mm[:, 1]), 0.0, 8.0)
    spread_mm = (local_mm[:, 0] + warp_mm) / (1.0 - style.oval * (side_mm / 9.0) ** 2)
    phase = spread_mm / style.spacing_mm
    line = np.floor(phase + 0.5)
    far_mm = np.abs(phase - line) * style.spacing_mm
    depths = factor_rng(0, 0, name).uniform(0.45, 1.0, 64)[line.astype(np.int64) % 64]
    reach = bump(local_mm[:, 0], style.reach_mm) * dorsal_share(skin.facing[rows])
    broken = 0.55 + 0.45 * smoothstep(-0.5, 0.4, skin.noise(3.0, 1, f"{name}/gap", rows))
    strength = depths * reach * broken
    groove = 0.7 * bump(far_mm, 0.28) + 0.3 * bump(far_mm, 0.6)
    swell_mm = 0.25 * style.depth_mm * reach
    depth_mm[rows] += swell_mm - style.depth_mm * strength * groove
