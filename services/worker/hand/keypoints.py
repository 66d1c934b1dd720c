"""Where the 21 keypoints lie at rest, and which bones carry them.

0 wrist: the head of the capitate, about which the hand turns, WRIST_BEYOND_M beyond the level of
the styloid process of the radius, between the wrist's creases. 1 thumb CMC: the joint of trapezium
and first metacarpal. 2 thumb MCP, 3 thumb IP. 5, 9, 13, 17 MCP: where the finger turns in its
knuckle; then PIP and DIP. 4, 8, 12, 16, 20: TIP_DEPTH_M inside the end of the digit. All lie in the
middle of the flesh there, not in the middle of the bone, which is nearer the back.

The asset's thumb turns elsewhere than a human one: its first metacarpal measures 33 mm to 39 of the
next segment, human ones 46 to 32 (Buryanov and Kotiuk 2010). So CMC and MCP are put where anatomy
has them, a little off the asset's own joints.
"""

import numpy as np

from services.worker.hand.asset import F8, I4
from services.worker.hand.bones import BONE_INDEX, BONES
from services.worker.hand.model import HandModel
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit
from services.worker.hand.subdivide import Subdivision
from services.worker.hand.surface import Section, limb_chord, limb_section, ray_hits

TIP_DEPTH_M = 0.004
"""How far inside the end of the finger its tip keypoint lies."""
TIPS = (4, 8, 12, 16, 20)
TIP_PARTS = tuple(HandPart(f"{digit}_distal") for digit in DIGITS)
TIP_FLESH_M = 0.004
"""Standard deviation of how far the flesh about a tip reaches."""
WRIST_BEYOND_M = 0.005
"""The proximal pole of the capitate lies level with the radial styloid, its centre 5 mm beyond."""
TRAPEZIUM = np.array([0.94, 0.78, 1.0])
"""The thumb's CMC joint, as shares of where the asset's first metacarpal begins: its wrist joint is
the origin."""
THUMB_MCP_BEYOND = 0.04
"""How far beyond the asset's joint the thumb's MCP lies, in lengths of the proximal phalanx.

A third of what anatomy asks, for the skin bends about the asset's joint."""

DORSAL = np.array([0.0, 0.0, 1.0])

_SEGMENTS = {
    "thumb": ("hand", "thumb_metacarpal", "thumb_proximal", "thumb_distal"),
} | {
    finger: tuple(f"{finger}_{s}" for s in ("metacarpal", "proximal", "middle", "distal"))
    for finger in DIGITS[1:]
}


def tip_flesh(model: HandModel) -> F8:
    """(5,V): the flesh about each digit's tip keypoint, rows sum to 1.

    Where it is pressed flat the tip moves with it; joints lie between bones, which nothing presses.
    """
    away_m = np.linalg.norm(model.keypoints_m[list(TIPS), None] - model.vertices_m, axis=2)
    segments = np.array([PARTS.index(part) for part in TIP_PARTS])
    share = np.exp(-0.5 * (away_m / TIP_FLESH_M) ** 2) * (model.part == segments[:, None])
    rows: F8 = share / share.sum(axis=1, keepdims=True)
    return rows


def keypoint_weights() -> F8:
    """(21,B): a joint is carried half by either neighbour, a tip by its last segment."""
    weights = np.zeros((1 + 4 * len(DIGITS), len(BONES)))
    weights[0, [BONE_INDEX["forearm_twist_3"], BONE_INDEX["hand"]]] = 0.5
    for digit, segments in enumerate(_SEGMENTS.values()):
        bones = [BONE_INDEX[name] for name in segments]
        for joint in range(3):
            weights[1 + 4 * digit + joint, bones[joint : joint + 2]] = 0.5
        weights[4 + 4 * digit, bones[3]] = 1.0
    return weights


def section_points(
    vertices_m: F8, faces: I4, heads_m: F8, tails_m: F8, hinges: F8
) -> list[Section]:
    """The 21 keypoints at rest, each in the middle of its cross-section.

    Where the limb's outline is its own (wrist, PIP, DIP, thumb IP) that is the centroid of the
    section; in the palm (MCP, thumb CMC) it is halfway between dorsal and palmar skin.
    vertices_m, faces: the smooth surface as triangles (T,3).
    """
    way = unit(tails_m - heads_m)
    wrist = limb_section(
        heads_m[BONE_INDEX["hand"]] + np.array([0.0, WRIST_BEYOND_M, 0.0]),
        way[BONE_INDEX["forearm"]] + np.array([0.0, 1.0, 0.0]),
        vertices_m,
        faces,
    )
    points = [wrist]
    for digit, hinge in zip(DIGITS, hinges, strict=True):
        bones = [BONE_INDEX[name] for name in _SEGMENTS[digit]]
        joints_m = heads_m[bones].copy()
        if digit == "thumb":
            joints_m[1] *= TRAPEZIUM
            joints_m[2] += THUMB_MCP_BEYOND * (tails_m - heads_m)[bones[2]]
        first_free = 2 if digit == "thumb" else 1
        for joint in range(3):
            before, after = bones[joint], bones[joint + 1]
            head = joints_m[joint + 1]
            if joint >= first_free:
                points.append(limb_section(head, way[before] + way[after], vertices_m, faces))
            else:
                carpal = digit == "thumb" and joint == 0
                dorsal = DORSAL if carpal else np.cross(way[after], hinge)
                points.append(limb_chord(head, dorsal, vertices_m, faces))
        points.append(_tip(heads_m[bones[3]], tails_m[bones[3]], vertices_m, faces))
    return points


def _tip(head: F8, tail: F8, vertices_m: F8, faces: I4) -> Section:
    """The middle of the finger TIP_DEPTH_M inside its end."""
    way = unit(tail - head)
    middle = limb_section((head + tail) / 2.0, way, vertices_m, faces).centre_m
    reach = ray_hits(middle, way[None], vertices_m, faces)[0, 0]
    return limb_section(middle + way * (reach - TIP_DEPTH_M), way, vertices_m, faces)


def keypoint_binding(sections: list[Section], smooth: Subdivision) -> F8:
    """(21,V): each keypoint as an affine mean of the control vertices of the skin round it.

    So a keypoint stays the middle of its section while the hand's shape changes, and is linear
    in the vertices.
    """
    binding = np.empty((len(sections), smooth.control_count))
    lengths = np.diff(smooth.starts)
    for row, section in enumerate(sections):
        shares = section.shares * _affine_weights(section)[:, None]
        on_smooth = np.bincount(
            section.faces.ravel(), shares.ravel(), minlength=smooth.vertex_count
        )
        spread = smooth.values * np.repeat(on_smooth, lengths)
        binding[row] = np.bincount(smooth.columns, spread, minlength=smooth.control_count)
    return binding


def _affine_weights(section: Section) -> F8:
    """Weights (N,) of the outline's points, as even as can be, that sum to 1 and give the middle.

    Least squares about even weights; the outline may lie in a plane or on a line.
    """
    count = len(section.points_m)
    even = np.full(count, 1.0 / count)
    offsets = section.points_m - section.centre_m
    scale = np.abs(offsets).max()
    conditions = np.vstack([offsets.T / scale, np.ones(count)])
    missing = np.array([0.0, 0.0, 0.0, 1.0]) - conditions @ even
    weights: F8 = even + np.linalg.lstsq(conditions, missing, rcond=1e-9)[0]
    return weights


def digit_lines_m(keypoints_m: F8) -> dict[str, F8]:
    """The middle line of the free segments of each digit: (4,3) of a finger, (3,3) of the thumb."""
    lines = {}
    for row, digit in enumerate(DIGITS):
        first = 2 if digit == "thumb" else 1
        lines[digit] = keypoints_m[4 * row + first : 4 * row + 5]
    return lines
