import cv2
import numpy as np
import numpy.typing as npt
import pytest

from hi5_common.domain.seeding import factor_rng
from services.worker.compose.camera_look import (
    BRIGHTEST,
    SHOULDER_START,
    Noise,
    out_of_focus,
    shoulder,
    softened,
    straightened,
)
from services.worker.scene.camera_look import PLAIN_LOOK, CameraLook, draw_camera_look

F4 = npt.NDArray[np.float32]
SOFT = CameraLook(2.0, 0.0, 0.0, 0.0, 0)
GRAINY = CameraLook(0.0, 0.0, 1e-3, 1e-5, 7)
SHALLOW = CameraLook(0.0, 4.0, 0.0, 0.0, 0)


def _light(side_px: int = 640) -> F4:
    rng = factor_rng(3, 0, "light")
    return rng.random((side_px, side_px, 3), dtype=np.float32) * np.float32(SHOULDER_START)


def photographed(bent: F4, look: CameraLook) -> F4:
    return Noise(look).on_bent(softened(bent, look))


def test_the_plain_look_changes_nothing_below_the_shoulder() -> None:
    light = _light(32)
    everywhere = np.ones(light.shape[:2], dtype=np.bool_)
    assert (photographed(light, PLAIN_LOOK) == light).all()
    assert (out_of_focus(light, everywhere, PLAIN_LOOK, 700.0, 0.4) == light).all()


def test_softness_is_a_share_of_the_picture() -> None:
    def spread(side_px: int) -> float:
        light = np.zeros((side_px, side_px, 3), dtype=np.float32)
        light[side_px // 2, side_px // 2] = 0.4
        row = photographed(light, SOFT)[..., 0].sum(axis=0).astype(np.float64)
        away = np.arange(side_px) - side_px // 2
        return float(np.sqrt((row * away**2).sum() / row.sum()))

    assert spread(640) == pytest.approx(2.0, rel=0.02)
    assert spread(1280) == pytest.approx(4.0, rel=0.02)


def test_noise_has_the_variance_of_counted_light() -> None:
    for level in (0.0, 0.1, 0.4):
        light = np.full((200, 200, 3), level, dtype=np.float32)
        grain = Noise(GRAINY).on(light) - light
        assert grain.mean() == pytest.approx(0.0, abs=5e-4)
        assert grain.var() == pytest.approx(1e-3 * level + 1e-5, rel=0.03)


def test_noise_is_drawn_by_its_seed_alone() -> None:
    light = _light(64)
    threads = cv2.getNumThreads()
    pictures = []
    try:
        for count in (1, 2, 4):
            cv2.setNumThreads(count)
            pictures.append(photographed(light, CameraLook(0.8, 2.0, 1e-3, 1e-5, 7)))
    finally:
        cv2.setNumThreads(threads)
    assert all((picture == pictures[0]).all() for picture in pictures)
    assert (Noise(GRAINY).on(light) != Noise(CameraLook(0.0, 0.0, 1e-3, 1e-5, 8)).on(light)).any()


def test_the_shoulder_keeps_order_and_never_burns() -> None:
    light = np.linspace(0.0, BRIGHTEST, 2001, dtype=np.float32)
    bent = shoulder(light)
    assert (bent[light <= SHOULDER_START] == light[light <= SHOULDER_START]).all()
    assert (np.diff(bent) > 0).all()
    assert bent.max() < 1.0
    assert shoulder(np.array([1e4], dtype=np.float32)) == bent.max()
    assert straightened(bent) == pytest.approx(light, rel=1e-4)
    around = shoulder(np.array([0.499, 0.5, 0.501], dtype=np.float32))
    assert np.diff(around) == pytest.approx(1e-3, rel=0.02)


def test_what_the_hand_hides_does_not_bleed_over_its_edge() -> None:
    background = np.ones((64, 64, 3), dtype=np.float32)
    seen = np.ones((64, 64), dtype=np.bool_)
    seen[16:48, 16:48] = False
    background[~seen] = 0.0
    blurred = out_of_focus(background, seen, SHALLOW, 700.0, 0.3)
    assert blurred[seen] == pytest.approx(1.0, abs=1e-5)


def test_a_nearer_hand_leaves_the_background_softer() -> None:
    background = np.zeros((65, 65, 3), dtype=np.float32)
    background[32, 32] = 1.0
    seen = np.ones((65, 65), dtype=np.bool_)
    near, far = (
        float(out_of_focus(background, seen, SHALLOW, 700.0, metres).max()) for metres in (0.3, 0.6)
    )
    assert near < far < 1.0
    assert out_of_focus(background, seen, SHALLOW, 700.0, 3.0).max() == 1.0


def test_low_light_is_noisier() -> None:
    looks = [draw_camera_look(factor_rng(1, 2, "camera_look"), ev) for ev in (-1.0, 0.0, 4.0)]
    assert looks[0] == looks[1]
    assert looks[2].shot_noise == pytest.approx(4.0 * looks[1].shot_noise)
    assert looks[2].read_noise == pytest.approx(16.0 * looks[1].read_noise)
