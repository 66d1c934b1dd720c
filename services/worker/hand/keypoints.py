"""Where the 21 keypoints lie at rest, and which bones carry them."""

import numpy as np

from services.worker.hand.asset import F8, I4
from services.worker.hand.bones import BONE_INDEX, BONES
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit
from services.worker.hand.surface import chord_centre, ray_hits, section_centre

TIP_DEPTH_M = 0.004
"""How far inside the end of the finger its tip keypoint lies."""

_SEGMENTS = {
    "thumb": ("hand", "thumb_metacarpal", "thumb_proximal", "thumb_distal"),
} | {
    finger: tuple(f"{finger}_{s}" for s in ("metacarpal", "proximal", "middle", "distal"))
    for finger in DIGITS[1:]
}


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


def rest_keypoints_m(vertices_m: F8, faces: I4, heads_m: F8, tails_m: F8, hinges: F8) -> F8:
    """(21,3) at rest, each in the middle of its cross-section.

    Where the limb's outline is its own (wrist, PIP, DIP, thumb IP) that is the centroid of the
    section; in the palm (MCP, thumb CMC) it is halfway between dorsal and palmar skin.
    vertices_m, faces: the smooth surface as triangles (T,3).
    """
    way = unit(tails_m - heads_m)
    wrist = section_centre(
        heads_m[BONE_INDEX["hand"]],
        way[BONE_INDEX["forearm"]] + np.array([0.0, 1.0, 0.0]),
        vertices_m,
        faces,
    )
    points = [wrist]
    for digit, hinge in zip(DIGITS, hinges, strict=True):
        bones = [BONE_INDEX[name] for name in _SEGMENTS[digit]]
        first_free = 2 if digit == "thumb" else 1
        for joint in range(3):
            before, after = bones[joint], bones[joint + 1]
            head = heads_m[after]
            if joint >= first_free:
                points.append(section_centre(head, way[before] + way[after], vertices_m, faces))
            else:
                dorsal = np.cross(way[after], hinge)
                points.append(chord_centre(head, dorsal, vertices_m, faces))
        points.append(_tip(heads_m[bones[3]], tails_m[bones[3]], vertices_m, faces))
    return np.stack(points)


def _tip(head: F8, tail: F8, vertices_m: F8, faces: I4) -> F8:
    """The middle of the finger TIP_DEPTH_M inside its end."""
    way = unit(tail - head)
    middle = section_centre((head + tail) / 2.0, way, vertices_m, faces)
    reach = ray_hits(middle, way[None], vertices_m, faces)[0, 0]
    return section_centre(middle + way * (reach - TIP_DEPTH_M), way, vertices_m, faces)
