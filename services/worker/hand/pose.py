"""Forward kinematics: joint angles to bone transforms.

The posed hand lives in the ELBOW FRAME. Its origin is the wrist joint. The forearm lies on -y and
points along FOREARM_AXIS (+y) to the hand, whatever the pose. At forearm_pronation 0 and a straight
wrist a right hand has +x ulnar, +y distal, +z dorsal, as at rest: its thumb side looks along
THUMB_UP_AXIS (-x), its palm along PALM_AXIS (-z). Pronation turns what is distal of the elbow about
+y so that the palm turns from PALM_AXIS away from the thumb: at +90 the palm looks along
-THUMB_UP_AXIS (down in a handshake), at -90 along THUMB_UP_AXIS (up).

To stand the hand in a world, map FOREARM_AXIS to the way the forearm points and THUMB_UP_AXIS to
the way that is "thumb up" at pronation 0 (perpendicular to it; for a forearm raised upright from a
handshake that is towards the hand's owner). The rotation follows from the two. A left hand is the
mirror image in x: use `thumb_up_axis(handedness)`.
"""

import numpy as np

from hi5_common.domain.vocabulary import Handedness
from services.worker.hand.angles import ANGLE_INDEX, JointAngles
from services.worker.hand.bones import BONE_INDEX, FINGERS, FOREARM_TWISTS
from services.worker.hand.model import F8, HandModel
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import about, around, swing, unit

FOREARM_AXIS: tuple[float, float, float] = (0.0, 1.0, 0.0)
"""Where the posed forearm points, elbow to wrist, in the elbow frame of either hand."""
THUMB_UP_AXIS: tuple[float, float, float] = (-1.0, 0.0, 0.0)
"""Where the thumb side of a RIGHT hand looks at pronation 0: this way is up in a handshake."""
PALM_AXIS: tuple[float, float, float] = (0.0, 0.0, -1.0)
"""Where the palm of either hand looks at pronation 0 and a straight wrist."""

_X, _Y, _Z = np.eye(3)


def thumb_up_axis(handedness: Handedness) -> tuple[float, float, float]:
    """THUMB_UP_AXIS of this hand: -x for a right, +x for a left hand."""
    x, y, z = THUMB_UP_AXIS
    return (x, y, z) if handedness is Handedness.RIGHT else (-x, y, z)


def posed_bones(model: HandModel, angles: JointAngles) -> F8:
    """Transforms (B,4,4) that take rest points of each bone to the elbow frame.

    Angles are absolute; the rest angles of the mesh are taken off. Order of rotations, proximal
    first: pronation about the forearm; wrist flexion, then deviation; carpal flexion of ring and
    little finger; MCP flexion, then abduction about the phalanx's own dorsal axis; thumb
    metacarpal swung to azimuth and palmar abduction, then rolled by -pronation; hinges after.
    """
    if model.handedness is Handedness.RIGHT:
        return _right_bones(model.bone_heads_m, model.bone_tails_m, model, angles)
    flip = np.array([-1.0, 1.0, 1.0])
    right = _right_bones(model.bone_heads_m * flip, model.bone_tails_m * flip, model, angles)
    mirror = np.array([-1.0, 1.0, 1.0, 1.0])
    left: F8 = right * np.outer(mirror, mirror)
    return left


def _right_bones(heads_m: F8, tails_m: F8, model: HandModel, angles: JointAngles) -> F8:
    way = unit(tails_m - heads_m)
    local = {
        **_thumb_rotations(way, model, angles),
        **_finger_rotations(way, model, angles),
    }
    bones = np.empty((len(heads_m), 4, 4))
    bones[: len(FOREARM_TWISTS)] = _forearm_transforms(way[BONE_INDEX["forearm"]], angles)
    for name, row in BONE_INDEX.items():
        if name == "hand":
            bones[row] = _hand_transform(angles)
        elif not name.startswith("forearm"):
            joint = around(heads_m[row], local[name])
            bones[row] = bones[model.parents[row]] @ joint
    return bones


def _forearm_transforms(forearm_way: F8, angles: JointAngles) -> F8:
    """(4,4,4): the forearm laid on the axis, each bone with its share of the pronation."""
    laid = swing(forearm_way, _Y)
    turns = [about(_Y, -share * angles.forearm_pronation) @ laid for share in FOREARM_TWISTS]
    return np.stack([around(np.zeros(3), turn) for turn in turns])


def _hand_transform(angles: JointAngles) -> F8:
    """The hand at rest looks along y with z dorsal, so its absolute wrist angles apply as are."""
    wrist = about(-_X, angles.wrist_flex) @ about(-_Z, angles.wrist_ulnar_dev)
    return around(np.zeros(3), about(_Y, -angles.forearm_pronation) @ wrist)


def _finger_rotations(way: F8, model: HandModel, angles: JointAngles) -> dict[str, F8]:
    delta = angles.as_array() - model.rest_angles_deg
    rotations: dict[str, F8] = {}
    for finger in FINGERS:
        hinge = model.hinges[DIGITS.index(finger)]

        def turn(joint: str, finger: str = finger) -> float:
            return float(delta[ANGLE_INDEX[f"{finger}_{joint}"]])

        side = 1.0 if finger in ("index", "middle") else -1.0
        dorsal = np.cross(way[BONE_INDEX[f"{finger}_proximal"]], hinge)
        arch = {"ring": angles.cmc4_flex, "pinky": angles.cmc5_flex}.get(finger, 0.0)
        rotations |= {
            f"{finger}_metacarpal": about(hinge, arch),
            f"{finger}_proximal": about(hinge, turn("mcp_flex"))
            @ about(dorsal, side * turn("mcp_abd")),
            f"{finger}_middle": about(hinge, turn("pip_flex")),
            f"{finger}_distal": about(hinge, turn("dip_flex")),
        }
    return rotations


def _thumb_rotations(way: F8, model: HandModel, angles: JointAngles) -> dict[str, F8]:
    delta = angles.as_array() - model.rest_angles_deg
    hinge = model.hinges[DIGITS.index("thumb")]
    azimuth, palmar = np.radians([angles.thumb_cmc_azimuth, angles.thumb_cmc_palmar_abd])
    target = np.array(
        [-np.sin(azimuth) * np.cos(palmar), np.cos(azimuth) * np.cos(palmar), -np.sin(palmar)]
    )
    swung = swing(way[BONE_INDEX["thumb_metacarpal"]], target)
    return {
        "thumb_metacarpal": about(target, -angles.thumb_cmc_pronation) @ swung,
        "thumb_proximal": about(hinge, float(delta[ANGLE_INDEX["thumb_mcp_flex"]])),
        "thumb_distal": about(hinge, float(delta[ANGLE_INDEX["thumb_ip_flex"]])),
    }
