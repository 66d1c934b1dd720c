"""Scenes are pure functions of (spec, seed, index) and keep the promises of their cells."""

import math
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.environments import HDRI_IDS
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import Handedness, Viewpoint
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.hand.skin import posed_hand
from services.worker.label.label import in_frame_share
from services.worker.scene.colour import ita_deg, lab_to_linear_rgb, linear_rgb_to_lab
from services.worker.scene.environments import load_panorama, mean_luminance
from services.worker.scene.geometry import build_geometry, transformed
from services.worker.scene.library import HandLibrary
from services.worker.scene.poses import pose_library
from services.worker.scene.sampling import hand_to_world, sample_scene
from services.worker.scene.types import HandScene, Stance
from services.worker.scene.view import (
    ViewedHand,
    camera_position,
    in_frame,
    polar_direction,
)

COUNT = 48


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


def spec_of(seed: int = 11, count: int = COUNT) -> DatasetSpec:
    return parse_spec({"count": count, "seed": seed})


@pytest.fixture(scope="module")
def scenes(hands: HandLibrary) -> list[HandScene]:
    spec = spec_of()
    plan = Plan.of(spec)
    return [sample_scene(spec, plan, index, hands) for index in range(COUNT)]


def flat(scene: HandScene) -> str:
    return repr(scene)


def test_a_scene_is_the_same_drawn_alone_and_in_any_order(
    hands: HandLibrary, scenes: list[HandScene], tmp_path: Path
) -> None:
    spec = spec_of()
    for index in (17, 3):
        again = sample_scene(spec, Plan.of(spec), index, HandLibrary(tmp_path))
        assert flat(again) == flat(scenes[index])
    other = spec_of(seed=12)
    assert flat(sample_scene(other, Plan.of(other), 3, hands)) != flat(scenes[3])


def test_at_most_a_quarter_of_the_hand_is_out_of_frame(
    hands: HandLibrary, scenes: list[HandScene]
) -> None:
    for scene in scenes:
        geometry = build_geometry(scene, hands)
        assert in_frame(scene.camera, geometry.keypoints_m).mean() >= 0.75
        assert in_frame_share(scene.camera, geometry) >= 0.75


def test_the_forearm_runs_out_of_the_picture(hands: HandLibrary, scenes: list[HandScene]) -> None:
    for scene in scenes:
        hand = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape)
        viewed = ViewedHand.of(hand, posed_hand(hand.model, scene.angles))
        assert len(viewed.cut_m) > 8
        assert not in_frame(scene.camera, viewed.placed(scene.hand_to_world).cut_m).any()


def test_the_hand_keeps_the_hard_joint_limits(scenes: list[HandScene]) -> None:
    assert all(not hard_limit_excess_deg(scene.angles).any() for scene in scenes)


def test_the_named_pose_is_the_nearer_end_of_the_blend(scenes: list[HandScene]) -> None:
    for scene in scenes:
        assert scene.blend.source is scene.cell.pose is not scene.blend.target
        assert 0.0 <= scene.blend.t <= 0.25
    assert len({scene.blend.t for scene in scenes}) == COUNT


def test_viewpoints_stand_where_their_person_does(scenes: list[HandScene]) -> None:
    seen = set()
    for scene in scenes:
        x, y, _ = camera_position(scene.camera) / scene.view.distance_m
        seen.add(scene.cell.viewpoint)
        match scene.cell.viewpoint:
            case Viewpoint.FIRST_PERSON:
                assert y < 0
            case Viewpoint.SECOND_PERSON:
                assert y > 0
            case Viewpoint.THIRD_PERSON:
                assert abs(x) > 0.4
    assert seen == set(Viewpoint)


def test_extrinsics_are_rigid_and_right_handed(scenes: list[HandScene]) -> None:
    for scene in scenes:
        for matrix in (scene.camera.world_to_camera, scene.hand_to_world):
            rotation = matrix[:3, :3]
            assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
            assert np.linalg.det(rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("handedness", Handedness)
def test_a_handshake_has_thumb_up_and_a_raised_pronated_palm_looks_ahead(
    hands: HandLibrary, scenes: list[HandScene], handedness: Handedness
) -> None:
    model = hands.hand(scenes[0].cell.gender, handedness).model
    assert model.handedness is handedness
    cell = next(scene.cell for scene in scenes if scene.cell.handedness is handedness)
    level = hand_to_world(Stance(0.0, 0.0), cell)
    thumb_side = np.array([-1.0 if handedness is Handedness.RIGHT else 1.0, 0.0, 0.0])
    assert np.allclose(level[:3, :3] @ thumb_side, [0, 0, 1])
    assert np.allclose(level[:3, :3] @ [0, 1, 0], [0, 1, 0])
    raised = hand_to_world(Stance(90.0, 0.0), cell)
    palm_after_pronation = -thumb_side  # pronating by 90 degrees turns the palm this way
    assert np.allclose(raised[:3, :3] @ palm_after_pronation, [0, 1, 0], atol=1e-12)


def test_polar_direction_points_from_y_towards_x_and_up() -> None:
    assert np.allclose(polar_direction(0, 0), [0, 1, 0])
    assert np.allclose(polar_direction(90, 0), [1, 0, 0])
    assert np.allclose(polar_direction(0, 90), [0, 0, 1])


def test_lab_of_the_white_point_and_round_trip() -> None:
    assert np.allclose(lab_to_linear_rgb((100.0, 0.0, 0.0)), 1.0)
    assert np.allclose(linear_rgb_to_lab(lab_to_linear_rgb((5.0, 3.0, 2.0))), (5.0, 3.0, 2.0))
    with pytest.raises(ValueError, match="b\\* > 0"):
        ita_deg((60.0, 5.0, 0.0))


def test_44_poses_have_angles_and_8_panoramas_have_light() -> None:
    assert len(pose_library()) == 44
    for environment in HDRI_IDS:
        assert load_panorama(environment).shape == (512, 1024, 3)
        assert 0.05 < mean_luminance(environment) < 5.0
        assert math.isfinite(mean_luminance(environment))


def test_geometry_is_the_model_placed_in_the_world(
    hands: HandLibrary, scenes: list[HandScene]
) -> None:
    scene = scenes[0]
    geometry = build_geometry(scene, hands)
    wrist_m = transformed(scene.hand_to_world, np.zeros((1, 3)))[0]
    assert np.linalg.norm(geometry.keypoints_m[0] - wrist_m) < 0.03
    assert geometry.quads.max() == len(geometry.vertices_m) - 1
    assert geometry.nail.shape == geometry.palm.shape == geometry.part.shape
