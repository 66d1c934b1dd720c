from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.angles import JointAngles
from services.worker.hand.maps import WEB_PARTS
from services.worker.hand.model import F8, HandModel
from services.worker.hand.pose import posed_bones
from services.worker.hand.rotation import unit
from services.worker.hand.skin import blended, posed_hand
from services.worker.hand.subdivide import subdivision
from services.worker.hand.surface import ray_hits, triangles, volume_m3, winding_numbers
from services.worker.scene.poses import pose_library

FLAT = pose_library()[Pose.NEUTRAL_RIGID]


def pip_sides_mm(hand: HandModel, skin_m: F8, angles: JointAngles) -> F8:
    """Skin above and below the middle finger's PIP keypoint, across the bend, in mm."""
    bones = posed_bones(hand, angles)
    rows = [hand.bone_names.index(f"middle_{s}") for s in ("proximal", "middle")]
    rest = unit(hand.bone_tails_m - hand.bone_heads_m)
    along = sum(bones[row, :3, :3] @ rest[row] for row in rows)
    dorsal = unit(np.cross(along, bones[rows[0], :3, :3] @ hand.hinges[2]))
    smooth = subdivision(hand, 2)
    point = posed_hand(hand, angles).keypoints_m[10]
    sides = np.stack([dorsal, -dorsal])
    return 1000.0 * ray_hits(point, sides, smooth.apply(skin_m), triangles(smooth.quads))[:, 0]


def test_rest_angles_leave_the_skin_at_rest(hand: HandModel) -> None:
    posed = posed_hand(hand, JointAngles.from_array(hand.rest_angles_deg))
    back = np.linalg.inv(posed.bones[hand.bone_names.index("hand")])
    skin = posed.vertices_m @ back[:3, :3].T + back[:3, 3]
    distal = hand.vertices_m[:, 1] > 0.03
    np.testing.assert_allclose(skin[distal], hand.vertices_m[distal], atol=1e-4)


@pytest.mark.parametrize("pose", list(Pose))
def test_keypoints_lie_inside_the_skin(hand: HandModel, pose: Pose) -> None:
    posed = posed_hand(hand, pose_library()[pose])
    winding = winding_numbers(posed.keypoints_m, posed.vertices_m, triangles(hand.quads))
    assert np.all(winding > 0.5)


@pytest.mark.parametrize("pose", list(Pose))
def test_left_skin_is_bit_for_bit_the_mirrored_right(hand: HandModel, pose: Pose) -> None:
    angles = pose_library()[pose]
    right, left = posed_hand(hand, angles), posed_hand(hand.mirrored(), angles)
    assert np.array_equal(left.vertices_m * [-1.0, 1.0, 1.0], right.vertices_m)
    assert np.array_equal(left.keypoints_m * [-1.0, 1.0, 1.0], right.keypoints_m)


def test_a_bent_finger_keeps_its_thickness(hand: HandModel) -> None:
    bent = replace(FLAT, middle_mcp_flex=0.0, middle_pip_flex=90.0)
    straight_mm = pip_sides_mm(hand, posed_hand(hand, FLAT).vertices_m, FLAT)
    bent_mm = pip_sides_mm(hand, posed_hand(hand, bent).vertices_m, bent)
    assert bent_mm.sum() > 0.95 * straight_mm.sum()
    assert abs(bent_mm[0] - bent_mm[1]) < 1.0  # the keypoint stays in the middle
    linear = blended(hand.vertices_m, hand.weights, posed_bones(hand, bent))
    assert pip_sides_mm(hand, linear, bent).sum() < 0.8 * straight_mm.sum()


def test_the_web_of_an_opposed_thumb_has_no_pit(hand: HandModel) -> None:
    edges = np.stack([hand.quads, np.roll(hand.quads, -1, axis=1)], axis=2).reshape(-1, 2)
    web = np.isin(hand.part[edges], WEB_PARTS).all(axis=1)
    posed_m = posed_hand(hand, pose_library()[Pose.PINKY_TIP]).vertices_m
    lengths = [
        np.linalg.norm(points[edges[web, 0]] - points[edges[web, 1]], axis=1)
        for points in (posed_m, hand.vertices_m)
    ]
    # The asset's own weights stretch an edge there 3.4-fold.
    assert (lengths[0] / lengths[1]).max() < 2.0


@pytest.mark.parametrize("pronation_deg", [-85.0, 85.0])
def test_twisted_forearm_keeps_its_volume(hand: HandModel, pronation_deg: float) -> None:
    faces = triangles(hand.quads)
    volumes = [
        volume_m3(posed_hand(hand, replace(FLAT, forearm_pronation=angle)).vertices_m, faces)
        for angle in (0.0, pronation_deg)
    ]
    assert volumes[1] == pytest.approx(volumes[0], rel=0.03)


def test_posing_is_repeatable(hands: dict[Gender, HandModel]) -> None:
    angles = pose_library()[Pose.FIST]
    once, again = (posed_hand(hands[Gender.MALE], angles) for _ in range(2))
    assert once.vertices_m.tobytes() == again.vertices_m.tobytes()
