import math

import cv2
import numpy as np
import pytest

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import ImageFormat, ImageRequest
from services.worker.compose.background import MAX_READINGS, readings_per_side, render_background
from services.worker.compose.camera_look import shoulder
from services.worker.compose.encode import encode_picture
from services.worker.compose.picture import (
    bent_layer,
    outlined,
    over,
    to_srgb8,
)
from services.worker.scene.types import Camera, Intrinsics

NARROW = Intrinsics(4000.0, 4000.0, 4.0, 4.0, 8, 8)


def _looking(forward: tuple[float, float, float]) -> Camera:
    z = np.array(forward)
    x = np.cross(z, [0.0, 0.0, 1.0])
    world_to_camera = np.eye(4)
    world_to_camera[:3, :3] = [x, np.cross(z, x), z]
    return Camera(NARROW, world_to_camera)


@pytest.mark.parametrize(
    ("forward", "rotation_deg", "column"),
    [
        ((1.0, 0.0, 0.0), 0.0, 8),  # the middle of the panorama looks along +x
        ((0.0, 1.0, 0.0), 0.0, 4),  # longitude grows to the left
        ((0.0, -1.0, 0.0), 0.0, 12),
        ((0.0, 1.0, 0.0), 90.0, 8),  # turned by 90°, what was at +x is at +y
    ],
)
def test_directions_find_their_columns(
    forward: tuple[float, float, float], rotation_deg: float, column: int
) -> None:
    panorama = np.zeros((8, 16, 3), dtype=np.float32)
    panorama[:, column - 1 : column + 1] = 1.0
    seen = render_background(
        _looking(forward), panorama, rotation_deg, np.ones((8, 8), dtype=np.bool_)
    )
    assert seen == pytest.approx(1.0, abs=1e-2)


def test_up_is_the_top_row_and_the_seam_is_closed() -> None:
    panorama = np.zeros((64, 128, 3), dtype=np.float32)
    panorama[:32] = 2.0
    wide = Camera(
        Intrinsics(8.0, 8.0, 8.0, 8.0, 16, 16), _looking((-1.0, 0.0, 0.0)).world_to_camera
    )
    seen = render_background(wide, panorama, 0.0, np.ones((16, 16), dtype=np.bool_))
    assert (seen[:7] == 2.0).all()
    assert (seen[9:] == 0.0).all()


def test_only_wanted_pixels_are_read() -> None:
    wanted = np.zeros((8, 8), dtype=np.bool_)
    wanted[2, 3] = True
    panorama = np.ones((8, 16, 3), dtype=np.float32)
    seen = render_background(_looking((1.0, 0.0, 0.0)), panorama, 0.0, wanted)
    assert (seen.any(axis=-1) == wanted).all()


@pytest.mark.parametrize("forward", [(1.0, 0.0, 0.0), (0.6, 0.0, 0.8), (0.1, 0.02, -0.99)])
@pytest.mark.parametrize("focal_px", [40.0, 100.0, 900.0])
def test_interpolated_gazes_are_those_worked_out_for_every_pixel(
    forward: tuple[float, float, float], focal_px: float
) -> None:
    x, y, z = np.array(forward) / np.linalg.norm(forward)
    camera = Camera(
        Intrinsics(focal_px, 1.1 * focal_px, 51.0, 47.0, 100, 90),
        _looking((float(x), float(y), float(z))).world_to_camera,
    )
    # Light is the direction that is looked in: smooth, and told apart everywhere.
    rows, columns = np.indices((512, 1024)) + 0.5
    longitude, latitude = math.pi * (1.0 - columns / 512.0), math.pi * (0.5 - rows / 512.0)
    level = np.cos(latitude)
    panorama = np.stack(
        [level * np.cos(longitude), level * np.sin(longitude), np.sin(latitude)], axis=-1
    ).astype(np.float32)
    seen = render_background(camera, panorama, 30.0, np.ones((90, 100), dtype=np.bool_))
    down, across = np.indices((90, 100)) + 0.5
    ray = np.stack(
        [(across - 51.0) / focal_px, (down - 47.0) / (1.1 * focal_px), np.ones_like(down)], axis=-1
    )
    ray = ray @ camera.world_to_camera[:3, :3]
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    turn = math.radians(30.0)
    back = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    wanted = np.concatenate([ray[..., :2] @ back, ray[..., 2:]], axis=-1)
    assert np.abs(seen - wanted).max() < (2e-3 if focal_px > 150.0 else 0.02)


def test_coarse_pixels_are_averages() -> None:
    assert readings_per_side(NARROW, 1024) == 1
    assert readings_per_side(Intrinsics(50.0, 50.0, 8, 8, 16, 16), 1024) == 4
    assert readings_per_side(Intrinsics(1.0, 1.0, 8, 8, 16, 16), 8192) == MAX_READINGS


def test_over_keeps_both_lights() -> None:
    rgba = np.array([[[0.25, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 0.0]]], dtype=np.float32)
    behind = np.ones((1, 2, 3), dtype=np.float32)
    assert over(rgba, behind).tolist() == [[[0.75, 0.5, 0.5], [1.0, 1.0, 1.0]]]


def test_a_hand_covers_what_its_mesh_does_in_the_colour_of_what_is_drawn_near() -> None:
    rng = factor_rng(1, 0, "coverage")
    true = np.clip(np.arange(24)[None] - 11.5 + 0.1 * np.arange(40)[:, None], 0.0, 1.0)
    alpha = rng.binomial(2, true) / 2.0
    skin = np.array([0.3, 0.2, 0.1])
    rgba = np.concatenate([skin * alpha[..., None], alpha[..., None]], axis=-1).astype(np.float32)
    found = outlined(rgba, true.astype(np.float32))
    edge = (true > 0.0) & (true < 1.0)
    assert (np.abs(alpha - true)[edge] > 0.1).any()
    seen = edge & (found[..., 3] > 0.0)
    assert seen.sum() > 0.9 * edge.sum()
    assert found[seen, 3] == pytest.approx(true[seen], abs=1e-6)
    own = found[seen, :3] / found[seen, 3:]
    assert own == pytest.approx(np.broadcast_to(skin, own.shape), rel=1e-3)
    assert (found[true == 1.0] == rgba[true == 1.0]).all()
    assert (outlined(rgba, None) == rgba).all()


def test_a_sliver_that_no_sample_met_is_left_out() -> None:
    share = np.zeros((9, 9), dtype=np.float32)
    share[4, 4] = 0.2
    assert (outlined(np.zeros((9, 9, 4), dtype=np.float32), share) == 0.0).all()


@pytest.mark.parametrize("window", [0.4, 2.0, 16.0, 60_000.0])
def test_a_half_covered_pixel_is_half_way_however_bright_the_window(window: float) -> None:
    coverage = np.linspace(0.0, 1.0, 11, dtype=np.float32)
    rgba = np.stack([0.6 * coverage] * 3 + [coverage], axis=-1)[None]
    gain = np.full(3, 2.0, dtype=np.float32)
    behind = shoulder(np.full((1, 11, 3), window, dtype=np.float32) * gain)
    seen = over(bent_layer(rgba, gain), behind)[0, :, 0]
    hand = float(shoulder(np.array([1.2], dtype=np.float32))[0])
    assert seen[-1] == pytest.approx(hand)
    # Even steps: laid over before the shoulder, the first nine are all white.
    assert np.diff(seen) == pytest.approx((hand - behind[0, 0, 0]) / 10.0, abs=1e-5)


def test_the_srgb_curve() -> None:
    linear = np.array([[[-1.0, 0.0, 0.001], [0.0031308, 0.18, 0.5], [1.0, 9.0, 0.2158605]]])
    assert to_srgb8(linear.astype(np.float32)).tolist() == [
        [[0, 0, 3], [10, 118, 188], [255, 255, 128]]
    ]


def _picture() -> np.ndarray:
    return factor_rng(1, 0, "picture").integers(0, 256, (48, 64, 3)).astype(np.uint8)


@pytest.mark.parametrize("kind", ImageFormat)
def test_bytes_depend_on_pixels_alone(kind: ImageFormat) -> None:
    request = ImageRequest(width=64, height=48, format=kind)
    threads = cv2.getNumThreads()
    files = set()
    try:
        for count in (1, 2, 4):
            cv2.setNumThreads(count)
            files.add(encode_picture(_picture(), request))
    finally:
        cv2.setNumThreads(threads)
    assert len(files) == 1


def test_png_is_lossless_and_in_the_right_order() -> None:
    data = encode_picture(_picture(), ImageRequest(width=64, height=48, format=ImageFormat.PNG))
    decoded = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert (decoded[..., ::-1] == _picture()).all()


def test_jpeg_is_444_with_the_quality_asked_for() -> None:
    best, worst = (
        encode_picture(_picture(), ImageRequest(width=64, height=48, jpeg_quality=quality))
        for quality in (95, 20)
    )
    frame = best.index(b"\xff\xc0")
    components, sampling = best[frame + 9], best[frame + 11 : frame + 20 : 3]
    assert (components, set(sampling)) == (3, {0x11})
    assert len(worst) < len(best) / 2
    assert b"Exif" not in best
