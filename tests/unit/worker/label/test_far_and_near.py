"""Keypoints stay right where floats are strained: far away, through any lens, at the lens.

Every bound is stated beside what it bounds; the oracle is the one of 40 digits.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from services.worker.label.projection import NEAR_M, to_camera, to_pixels
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.types import Camera, HandScene, Intrinsics
from tests.unit.worker.label.test_oracle import ORDINARY_PX, drawn, worst_px

SENSOR_MM = 36.0


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


@pytest.fixture(scope="module")
def scene(hands: HandLibrary) -> HandScene:
    return drawn(hands, 11)


def shifted(scene: HandScene, away_m: float) -> HandScene:
    """The same picture, hand and camera away_m from the origin."""
    away = away_m * np.array([2.0, -1.0, 2.0]) / 3.0
    placed = scene.hand_to_world.copy()
    placed[:3, 3] += away
    looked = scene.camera.world_to_camera.copy()
    looked[:3, 3] -= looked[:3, :3] @ away
    return replace(scene, hand_to_world=placed, camera=Camera(scene.camera.intrinsics, looked))


@pytest.mark.parametrize("away_m", [1e-3, 1.0, 1e3, 1e4])
def test_a_hand_anywhere_within_ten_kilometres(
    scene: HandScene, hands: HandLibrary, away_m: float
) -> None:
    # A double has 2e-12 m at 10 km: a hundred-millionth of a pixel at arm's length.
    assert worst_px(shifted(scene, away_m), hands) < ORDINARY_PX


@pytest.mark.parametrize("focal_mm", [2.0, 8.0, 50.0, 400.0, 2000.0])
def test_any_lens(scene: HandScene, hands: HandLibrary, focal_mm: float) -> None:
    lens = scene.camera.intrinsics
    focal_px = focal_mm / SENSOR_MM * lens.width_px
    longer = Intrinsics(focal_px, focal_px, lens.cx_px, lens.cy_px, lens.width_px, lens.height_px)
    seen = replace(scene, camera=Camera(longer, scene.camera.world_to_camera))
    assert worst_px(seen, hands) < ORDINARY_PX


def backed(scene: HandScene, hands: HandLibrary, depth_m: float) -> HandScene:
    """The camera moved along its axis until the first keypoint lies depth_m before its plane."""
    camera_m = to_camera(scene.camera, build_geometry(scene, hands).keypoints_m)
    looked = scene.camera.world_to_camera.copy()
    looked[2, 3] += depth_m - camera_m[0, 2]
    return replace(scene, camera=Camera(scene.camera.intrinsics, looked))


@pytest.mark.parametrize("depth_m", [-0.05, -1e-9, 0.0, 1e-9, 0.9 * NEAR_M])
def test_points_on_and_behind_the_cameras_plane_have_no_pixel(
    scene: HandScene, hands: HandLibrary, depth_m: float
) -> None:
    seen = backed(scene, hands, depth_m)
    keypoints_m = build_geometry(seen, hands).keypoints_m
    pixels = to_pixels(seen.camera.intrinsics, to_camera(seen.camera, keypoints_m))
    assert np.isnan(pixels[0]).all()


def test_points_just_before_the_plane(scene: HandScene, hands: HandLibrary) -> None:
    # Depth is a difference of metres there: 2e-16 of half a metre in 1.1 mm is 1e-13 of the pixel's
    # distance from the middle, which may be a million pixels.
    assert worst_px(backed(scene, hands, 1.1 * NEAR_M), hands) < 1e-4


def test_single_precision_would_not_do(scene: HandScene, hands: HandLibrary) -> None:
    """What float32 would cost: the reason that labels are float64."""
    keypoints_m = build_geometry(scene, hands).keypoints_m
    rough = keypoints_m.astype(np.float32)
    matrix = scene.camera.world_to_camera.astype(np.float32)
    camera_m = rough @ matrix[:3, :3].T + matrix[:3, 3]
    single = to_pixels(scene.camera.intrinsics, camera_m.astype(np.float64))
    double = to_pixels(scene.camera.intrinsics, to_camera(scene.camera, keypoints_m))
    worst = float(np.abs(single - double).max())
    assert 1e-5 < worst < 1e-2
    assert math.isfinite(worst)
