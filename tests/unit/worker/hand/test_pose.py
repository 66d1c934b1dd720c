from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender, Handedness, Pose
from services.worker.hand.angles import ANGLE_NAMES, JointAngles
from services.worker.hand.model import F8, HandModel
from services.worker.hand.pose import (
    FOREARM_AXIS,
    PALM_AXIS,
    THUMB_UP_AXIS,
    posed_bones,
    thumb_up_axis,
)
from services.worker.hand.rotation import unit
from services.worker.scene.poses import pose_library

STRAIGHT = replace(
    pose_library()[Pose.NEUTRAL_RIGID], wrist_flex=0.0, wrist_ulnar_dev=0.0, forearm_pronation=0.0
)
X, Y, Z = np.eye(3)


def way(hand: HandModel, bones: F8, name: str) -> F8:
    row = hand.bone_names.index(name)
    return bones[row, :3, :3] @ unit(hand.bone_tails_m[row] - hand.bone_heads_m[row])


def angle_deg(a: F8, b: F8) -> float:
    return float(np.degrees(np.arccos(np.clip(a @ b, -1.0, 1.0))))


def hand_rotation(hand: HandModel, angles: JointAngles) -> F8:
    return posed_bones(hand, angles)[hand.bone_names.index("hand"), :3, :3]


def test_angles_round_trip() -> None:
    array = np.arange(26.0)
    assert np.array_equal(JointAngles.from_array(array).as_array(), array)
    assert JointAngles.from_array(array).forearm_pronation == 25.0
    with pytest.raises(ValueError, match="26"):
        JointAngles.from_array(array[1:])


def test_rest_angles_give_the_rest_pose(hand: HandModel) -> None:
    bones = posed_bones(hand, JointAngles.from_array(hand.rest_angles_deg))
    row = hand.bone_names.index("hand")
    relative = np.linalg.inv(bones[row]) @ bones
    digits = [i for i, name in enumerate(hand.bone_names) if not name.startswith("forearm")]
    np.testing.assert_allclose(relative[digits], np.eye(4)[None].repeat(len(digits), 0), atol=1e-9)
    # The forearm is laid by one swing, the wrist bent about two axes: they differ by a twist.
    np.testing.assert_allclose(relative[: digits[0], :3, :3] - np.eye(3), 0.0, atol=0.005)


@pytest.mark.parametrize("pose", list(Pose))
def test_bones_are_rigid_and_stay_joined(hand: HandModel, pose: Pose) -> None:
    bones = posed_bones(hand, pose_library()[pose])
    rotation = bones[:, :3, :3]
    np.testing.assert_allclose(
        np.einsum("bij,bik->bjk", rotation, rotation) - np.eye(3), 0, atol=1e-12
    )
    assert np.all(np.linalg.det(rotation) > 0)
    heads = np.c_[hand.bone_heads_m, np.ones(len(bones))]
    for row, parent in enumerate(hand.parents[5:], 5):
        joint = heads[row]
        np.testing.assert_allclose(bones[row] @ joint, bones[parent] @ joint, atol=1e-12)


def test_target_angles_are_reached(hand: HandModel) -> None:
    posed = replace(STRAIGHT, index_pip_flex=70.0, index_dip_flex=30.0, thumb_ip_flex=25.0)
    bones = posed_bones(hand, posed)
    hinge = hand.hinges[1]
    row = hand.bone_names.index("index_proximal")
    axis = bones[row, :3, :3] @ hinge
    proximal, middle = way(hand, bones, "index_proximal"), way(hand, bones, "index_middle")
    across = [unit(v - axis * (axis @ v)) for v in (proximal, middle)]
    assert angle_deg(*across) == pytest.approx(70.0, abs=1e-6)
    thumb = posed_bones(hand, replace(STRAIGHT, thumb_cmc_azimuth=40.0, thumb_cmc_palmar_abd=30.0))
    metacarpal = way(hand, thumb, "thumb_metacarpal")
    assert np.degrees(np.arctan2(-metacarpal[0], metacarpal[1])) == pytest.approx(40.0)
    assert np.degrees(np.arcsin(-metacarpal[2])) == pytest.approx(30.0)


@pytest.mark.parametrize(
    ("finger", "side"), [("index", -1.0), ("middle", -1.0), ("ring", 1.0), ("pinky", 1.0)]
)
def test_abduction_and_flexion_signs(hand: HandModel, finger: str, side: float) -> None:
    rest = way(hand, posed_bones(hand, STRAIGHT), f"{finger}_proximal")
    joint = f"{finger}_mcp_abd"
    spread = replace(STRAIGHT, **{joint: getattr(STRAIGHT, joint) + 10.0})
    moved = way(hand, posed_bones(hand, spread), f"{finger}_proximal") - rest
    assert side * moved[0] > 0.1
    bent = way(
        hand,
        posed_bones(hand, replace(STRAIGHT, **{f"{finger}_mcp_flex": 90.0})),
        f"{finger}_proximal",
    )
    assert bent @ np.array(PALM_AXIS) > 0.8


def test_handshake_stands_on_the_documented_axes(hand: HandModel) -> None:
    np.testing.assert_allclose(hand_rotation(hand, STRAIGHT), np.eye(3), atol=1e-12)
    bones = posed_bones(hand, STRAIGHT)
    np.testing.assert_allclose(way(hand, bones, "forearm"), FOREARM_AXIS, atol=1e-12)
    assert np.array_equal(THUMB_UP_AXIS, -X)
    thumb = bones[hand.bone_names.index("thumb_proximal")]
    head = thumb @ np.append(hand.bone_heads_m[hand.bone_names.index("thumb_proximal")], 1.0)
    assert head[:3] @ np.array(THUMB_UP_AXIS) > 0.01


@pytest.mark.parametrize(("pronation_deg", "palm"), [(90.0, X), (-90.0, -X), (0.0, -Z)])
def test_pronation_turns_the_palm_down(hand: HandModel, pronation_deg: float, palm: F8) -> None:
    turned = hand_rotation(hand, replace(STRAIGHT, forearm_pronation=pronation_deg))
    # Down in a handshake is -THUMB_UP_AXIS = +x.
    np.testing.assert_allclose(turned @ -Z, palm, atol=1e-12)
    forearm = posed_bones(hand, replace(STRAIGHT, forearm_pronation=pronation_deg))[0]
    np.testing.assert_allclose(forearm, posed_bones(hand, STRAIGHT)[0], atol=1e-12)


def test_forearm_skin_twists_step_by_step_with_the_hand(hand: HandModel) -> None:
    straight = posed_bones(hand, STRAIGHT)
    turned = posed_bones(hand, replace(STRAIGHT, forearm_pronation=60.0))
    turns = np.einsum("bij,bkj->bik", turned[:5, :3, :3], straight[:5, :3, :3])
    degrees = np.degrees(np.arctan2(-turns[:, 0, 2], turns[:, 0, 0]))
    np.testing.assert_allclose(degrees, [0.0, 20.0, 40.0, 60.0, 60.0], atol=1e-9)


def test_wrist_signs(hand: HandModel) -> None:
    flexed = hand_rotation(hand, replace(STRAIGHT, wrist_flex=30.0)) @ Y
    ulnar = hand_rotation(hand, replace(STRAIGHT, wrist_ulnar_dev=20.0)) @ Y
    np.testing.assert_allclose(flexed, [0.0, np.cos(np.pi / 6), -0.5], atol=1e-12)
    assert ulnar[0] == pytest.approx(np.sin(np.radians(20.0)))


def test_left_bones_mirror_the_right(hand: HandModel) -> None:
    angles = pose_library()[Pose.CAPISCE]
    flip = np.diag([-1.0, 1.0, 1.0, 1.0])
    right, left = posed_bones(hand, angles), posed_bones(hand.mirrored(), angles)
    assert np.array_equal(flip @ left @ flip, right)
    assert thumb_up_axis(Handedness.LEFT) == (1.0, 0.0, 0.0)


def test_every_angle_moves_the_hand(hands: dict[Gender, HandModel]) -> None:
    hand = hands[Gender.MALE]
    still = posed_bones(hand, STRAIGHT)
    for name in ANGLE_NAMES:
        moved = posed_bones(hand, replace(STRAIGHT, **{name: getattr(STRAIGHT, name) + 5.0}))
        assert np.abs(moved - still).max() > 0.05, name
