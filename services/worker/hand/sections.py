"""How a joint's thickness and width change as it bends: the test of skinning."""

from dataclasses import dataclass, replace

import numpy as np

from services.worker.hand.angles import JointAngles
from services.worker.hand.bones import BONE_INDEX, FINGERS
from services.worker.hand.corrective import corrected_m
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.hand.model import F8, HandModel
from services.worker.hand.pose import posed_bones
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit
from services.worker.hand.skin import PosedHand, blended, posed_hand, skinned
from services.worker.hand.subdivide import Subdivision
from services.worker.hand.surface import ray_hits, triangles, volume_m3

STRAIGHT = JointAngles.from_array(np.zeros(26))
FAN = 9
SPREAD_DEG = {"index": 14.0, "middle": 0.0, "ring": 12.0, "pinky": 22.0}
"""Fingers are measured apart: skin of a neighbour must not stand in the way."""


@dataclass(frozen=True)
class Joint:
    """A hinge of a digit: its angle, its keypoint, the bones on either side."""

    name: str
    digit: str
    keypoint: int
    before: str
    after: str

    @property
    def in_palm(self) -> bool:
        """Tell whether the skin on either side of the joint is the palm's."""
        return self.name.endswith("mcp_flex") and self.digit != "thumb"


def _joints() -> tuple[Joint, ...]:
    joints = []
    for finger in FINGERS:
        bones = [f"{finger}_{s}" for s in ("metacarpal", "proximal", "middle", "distal")]
        for step, joint in enumerate(("mcp", "pip", "dip")):
            keypoint = 1 + 4 * DIGITS.index(finger) + step
            joints.append(
                Joint(f"{finger}_{joint}_flex", finger, keypoint, bones[step], bones[step + 1])
            )
    thumb = ("thumb_metacarpal", "thumb_proximal", "thumb_distal")
    joints.append(Joint("thumb_mcp_flex", "thumb", 2, thumb[0], thumb[1]))
    joints.append(Joint("thumb_ip_flex", "thumb", 3, thumb[1], thumb[2]))
    return tuple(joints)


JOINTS: tuple[Joint, ...] = _joints()


@dataclass(frozen=True)
class JointSize:
    """A joint through its keypoint: from back to palm and from side to side, and the hand's flesh.

    The thickness is the least of the chords between those that stand square on either bone: a
    collapsed joint is thin there, and the long way through the corner of a bend does not count.
    width_m is nan where the joint lies in the palm.
    """

    thickness_m: float
    width_m: float
    volume_m3: float


def open_hand(**angles_deg: float) -> JointAngles:
    """A straight hand with its fingers and thumb apart, and some joints bent."""
    spread = {f"{finger}_mcp_abd": angle for finger, angle in SPREAD_DEG.items()}
    thumb = {"thumb_cmc_azimuth": 65.0, "thumb_cmc_palmar_abd": 40.0}
    return replace(STRAIGHT, **(spread | thumb | angles_deg))


def bent(joint: Joint, bend_deg: float) -> JointAngles:
    """The open hand with one joint bent, at most to its hard limit."""
    bend = {joint.name: bend_deg}
    if joint.in_palm:
        bend[f"{joint.digit}_mcp_abd"] = 0.0  # a bent knuckle is held sideways
    angles = open_hand(**bend)
    return JointAngles.from_array(angles.as_array() - hard_limit_excess_deg(angles))


def joint_size(
    hand: HandModel, smooth: Subdivision, joint: Joint, angles: JointAngles
) -> JointSize:
    """Measure a joint of a right hand as its bones carry it, before touching flesh is pressed.

    In the plane of the bend and along the hinge. See pressed_size for the hand as it is drawn.
    """
    bones = posed_bones(hand, angles)
    skin_m = skinned(corrected_m(hand, angles), hand.rotation_centres_m, hand.weights, bones)
    keypoints_m = blended(hand.keypoints_m, hand.keypoint_weights, bones)
    return _measured(hand, smooth, joint, PosedHand(skin_m, keypoints_m, bones))


def pressed_size(
    hand: HandModel, smooth: Subdivision, joint: Joint, angles: JointAngles
) -> JointSize:
    """The same of the posed hand, in whose folds flesh presses flesh: there it may be thicker."""
    return _measured(hand, smooth, joint, posed_hand(hand, angles))


def _measured(hand: HandModel, smooth: Subdivision, joint: Joint, posed: PosedHand) -> JointSize:
    skin_m, faces = smooth.apply(posed.vertices_m), triangles(smooth.quads)
    hinge, fan = _axes(hand, posed, joint)
    ways = np.concatenate([fan, -fan, [hinge, -hinge]])
    near = np.linalg.norm(skin_m[faces[:, 0]] - posed.keypoints_m[joint.keypoint], axis=1) < 0.06
    reach = ray_hits(posed.keypoints_m[joint.keypoint], ways, skin_m, faces[near])[:, 0]
    return JointSize(
        float((reach[:FAN] + reach[FAN : 2 * FAN]).min()),
        float("nan") if joint.in_palm else float(reach[-2:].sum()),
        volume_m3(skin_m, faces),
    )


def _axes(hand: HandModel, posed: PosedHand, joint: Joint) -> tuple[F8, F8]:
    """The hinge, and ways (FAN,3) from palm to back: square on one bone to square on the other."""
    rows = BONE_INDEX[joint.before], BONE_INDEX[joint.after]
    rest = [unit(hand.bone_tails_m[row] - hand.bone_heads_m[row]) for row in rows]
    if joint.in_palm:
        rest[0] = np.array([0.0, 1.0, 0.0])  # metacarpal bones of the asset lie aslant
    hinge = posed.bones[rows[1], :3, :3] @ hand.hinges[DIGITS.index(joint.digit)]
    ways = [posed.bones[row, :3, :3] @ way for row, way in zip(rows, rest, strict=True)]
    share = np.linspace(0.0, 1.0, FAN)[:, None]
    along = (1.0 - share) * unit(ways[0]) + share * unit(ways[1])
    return unit(hinge), unit(np.cross(along, hinge))
