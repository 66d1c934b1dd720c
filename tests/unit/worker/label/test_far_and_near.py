"""Keypoints stay right where floats are strained: far away, through any lens, at the lens.

Every bound is stated beside what it bounds; the oracle is the one of 40 digits.
"""

import numpy as np
import pytest

from benchmarks.stability.against import (
    backed,
    drawn,
    from_within,
    resized,
    shifted,
    single_px,
    through_lens,
    worst_px,
)
from services.worker.label.projected import project_mesh
from services.worker.label.projection import NEAR_M, to_camera, to_pixels
from services.worker.label.raster import rasterise
from services.worker.label.region import touched_region
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.types import HandScene
from tests.unit.worker.label.test_oracle import ORDINARY_PX


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


@pytest.fixture(scope="module")
def scene(hands: HandLibrary) -> HandScene:
    return drawn(hands, 11)


@pytest.mark.parametrize("away_m", [1e-3, 1.0, 1e3, 1e4])
def test_a_hand_anywhere_within_ten_kilometres(
    scene: HandScene, hands: HandLibrary, away_m: float
) -> None:
    # A double has 2e-12 m at 10 km: a hundred-millionth of a pixel at arm's length.
    assert worst_px(shifted(scene, away_m), hands) < ORDINARY_PX


@pytest.mark.parametrize("focal_mm", [2.0, 8.0, 50.0, 400.0, 2000.0])
def test_any_lens(scene: HandScene, hands: HandLibrary, focal_mm: float) -> None:
    assert worst_px(through_lens(scene, focal_mm), hands) < ORDINARY_PX


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
    assert 1e-5 < single_px(scene, hands) < 1e-2
    assert single_px(shifted(scene, 1e4), hands) > 1.0


@pytest.mark.parametrize("side_px", [16, 8192])
def test_the_smallest_and_the_largest_picture(
    scene: HandScene, hands: HandLibrary, side_px: int
) -> None:
    assert worst_px(resized(scene, side_px), hands) < ORDINARY_PX


def test_a_camera_in_the_palm_labels_what_is_before_it(
    scene: HandScene, hands: HandLibrary
) -> None:
    within = from_within(scene, hands)
    assert worst_px(within, hands) < 1e-4
    mesh = project_mesh(within.camera, build_geometry(within, hands))
    region = touched_region(mesh)
    assert 0 <= region.left <= region.right <= within.camera.intrinsics.width_px
    seen = rasterise(mesh)
    assert np.isfinite(seen.depth_m[seen.covered]).all()
    assert (seen.depth_m[seen.covered] > 0.0).all()
