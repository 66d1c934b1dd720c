"""Errors inside the hand, without the reference's own noise."""

import numpy as np
import pytest

from services.worker.bench.errors import (
    BEST_DB,
    F4,
    Halves,
    crop_box,
    cropped_to,
    displayed,
    errors_of,
)

SIDE = 96


def hand(light: float = 0.3) -> F4:
    """A disc of even light, premultiplied, on nothing."""
    y, x = np.mgrid[:SIDE, :SIDE]
    alpha = (np.hypot(x - 50, y - 44) < 30).astype(np.float32)
    rgb = np.full((SIDE, SIDE, 3), light, np.float32) * alpha[..., None]
    return np.concatenate([rgb, alpha[..., None]], axis=-1)


def noisy(picture: F4, seed: int, sigma: float) -> F4:
    rng = np.random.default_rng(seed)
    grain = sigma * rng.standard_normal((SIDE, SIDE, 3)).astype(np.float32)
    grainy = picture.copy()
    grainy[..., :3] += grain * picture[..., 3:]
    return grainy


def test_the_references_noise_is_not_counted() -> None:
    true = hand()
    picture = noisy(true, 1, 0.01)
    clean = errors_of(picture, Halves(true, true))
    rough = errors_of(picture, Halves(noisy(true, 2, 0.02), noisy(true, 3, 0.02)))
    assert rough.psnr_db == pytest.approx(clean.psnr_db, abs=0.3)
    assert rough.relmse == pytest.approx(clean.relmse, rel=0.1)
    one = noisy(true, 2, 0.02)
    assert errors_of(picture, Halves(one, one)).psnr_db < clean.psnr_db - 4.0


def test_a_known_error_has_its_known_figures() -> None:
    true, brighter = hand(0.3), hand(0.36)
    errors = errors_of(brighter, Halves(true, true))
    assert errors.relmse == pytest.approx(0.06**2 / (0.3**2 + 0.01), rel=1e-4)
    apart = 1.055 * (0.36 ** (1 / 2.4) - 0.3 ** (1 / 2.4))
    assert errors.psnr_db == pytest.approx(-20.0 * np.log10(apart), abs=0.01)
    assert errors.flip > 0.02
    assert errors.floor_flip == 0.0


def test_what_is_outside_of_the_hand_does_not_count() -> None:
    true = hand()
    other = true.copy()
    other[:5, :5] = 1.0
    errors = errors_of(other, Halves(true, true))
    assert errors.psnr_db == BEST_DB
    assert errors.relmse == 0.0


def test_fine_noise_is_averaged_out_in_the_crop() -> None:
    true = hand()
    large = np.kron(true, np.ones((6, 6, 1), np.float32))
    rng = np.random.default_rng(0)
    grainy = large.copy()
    grainy[..., :3] += 0.05 * rng.standard_normal((*large.shape[:2], 3)).astype(np.float32)
    grainy[..., :3] *= large[..., 3:]
    errors = errors_of(grainy, Halves(large, large))
    assert errors.crop_psnr_db > errors.psnr_db + 2.0


def test_an_edge_that_the_crop_repeats_is_counted_once() -> None:
    true = np.zeros((400, 400, 4), np.float32)
    true[:, :120] = (0.3, 0.3, 0.3, 1.0)  # an arm that leaves the picture on the left
    other = true.copy()
    other[:, 0, :3] = 0.4
    errors = errors_of(other, Halves(true, true))
    assert crop_box(true[..., 3] > 0.5)[0] < -50
    share = 400 * 1 / (400 * 120)
    apart = 1.055 * (0.4 ** (1 / 2.4) - 0.3 ** (1 / 2.4))
    assert errors.psnr_db == pytest.approx(-10.0 * np.log10(apart**2 * share), abs=0.01)
    assert errors.crop_psnr_db > errors.psnr_db - 1.0


def test_the_crop_is_square_about_the_hand_and_may_leave_the_picture() -> None:
    mask = np.zeros((64, 64), np.bool_)
    mask[0:40, 50:64] = True
    left, top, side = crop_box(mask)
    assert side == 50
    assert (left, top) == (32, -5)
    assert cropped_to(mask.astype(np.float32), (left, top, side)).shape == (256, 256)


def test_half_covered_pixels_show_half_of_the_ground() -> None:
    pixel = np.array([[[0.5, 0.5, 0.5, 0.5]]], np.float32)
    assert displayed(pixel)[0, 0, 0] == pytest.approx(0.75)
