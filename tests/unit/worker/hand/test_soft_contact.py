from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.contact.folds import folded
from services.worker.hand.contact.measure import self_penetration
from services.worker.hand.contact.overlap import normals_of
from services.worker.hand.family import HandFamily
from services.worker.hand.model import F8, HandModel
from services.worker.hand.pose import posed_bones
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.hand.skin import blended, posed_hand, skinned, unpressed
from services.worker.hand.soft_contact import MOST_M, pressed
from services.worker.hand.subdivide import subdivision
from services.worker.hand.surface import triangles, volume_m3
from services.worker.scene.poses import pose_library, solved_angles


def raw_skin(hand: HandModel, pose: Pose) -> F8:
    bones = posed_bones(hand, pose_library()[pose])
    return skinned(hand.vertices_m, hand.rotation_centres_m, hand.weights, bones)


def deepest_mm(hand: HandModel, control_m: F8) -> float:
    fine = subdivision(hand, 1)
    return 1000.0 * self_penetration(fine.apply(control_m), fine.quads).deepest_m


def test_folds_of_bent_fingers_do_not_pass_through_each_other(hand: HandModel) -> None:
    bones = posed_bones(hand, pose_library()[Pose.CLAWS])
    raw = raw_skin(hand, Pose.CLAWS)
    assert deepest_mm(hand, raw) > 1.0
    assert deepest_mm(hand, folded(hand, raw, bones)) < 0.5


def test_a_hand_that_touches_nothing_is_not_pressed(hand: HandModel) -> None:
    raw = raw_skin(hand, Pose.FIVE)
    np.testing.assert_array_equal(pressed(hand, raw), raw)


def test_overlapping_fingertips_are_pressed_flat(hand: HandModel) -> None:
    pinch = solved_angles(hand.gender, Pose.INDEX_TIP, HandShape.average())
    firm = replace(pinch, thumb_ip_flex=pinch.thumb_ip_flex + 3.0)
    raw = unpressed(hand, firm, posed_bones(hand, firm))
    assert deepest_mm(hand, raw) > 0.8
    soft, faces = pressed(hand, raw), triangles(hand.quads)
    assert deepest_mm(hand, soft) < 0.5
    moved = np.linalg.norm(soft - raw, axis=1)
    assert 0 < (moved > 0.001).sum() < 200
    assert moved.max() <= MOST_M
    assert abs(volume_m3(soft, faces) / volume_m3(raw, faces) - 1.0) < 0.01


def test_tips_alone_move_with_flesh_that_is_pressed(hand: HandModel) -> None:
    pinch = solved_angles(hand.gender, Pose.INDEX_TIP, HandShape.average())
    firm = replace(pinch, thumb_ip_flex=pinch.thumb_ip_flex + 3.0)
    bones = posed_bones(hand, firm)
    carried_m = blended(hand.keypoints_m, hand.keypoint_weights, bones)
    posed = posed_hand(hand, firm)
    moved_mm = 1000.0 * np.linalg.norm(posed.keypoints_m - carried_m, axis=1)
    assert set(np.flatnonzero(moved_mm)) == {4, 8}
    assert (moved_mm[[4, 8]] > 0.05).all()
    apart_mm = [1000.0 * np.linalg.norm(k[4] - k[8]) for k in (carried_m, posed.keypoints_m)]
    assert apart_mm[1] > apart_mm[0]


@pytest.mark.parametrize("gender", Gender)
def test_the_back_of_a_bent_joint_is_not_taken_for_an_overlap(
    gender: Gender, families: dict[Gender, HandFamily]
) -> None:
    """Thin fingers, closed: the two sides of a sharp edge lie as near as those of a fold."""
    thin = dict(SHAPE_EXTREMES)["all_low"]
    hand = families[gender].shaped(thin)
    angles = solved_angles(gender, Pose.FIST, thin)
    raw = unpressed(hand, angles, posed_bones(hand, angles))
    moved_mm = 1000.0 * np.linalg.norm(pressed(hand, raw) - raw, axis=1)
    back = normals_of(hand.vertices_m, hand.quads)[:, 2] > 0.8
    for pip in (6, 10, 14):
        near = np.linalg.norm(hand.vertices_m - hand.keypoints_m[pip], axis=1) < 0.009
        assert (near & back).sum() >= 3
        assert moved_mm[near & back].max() < 0.5
    assert moved_mm.max() > 1.0
