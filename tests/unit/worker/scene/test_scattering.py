import math

import pytest

from services.worker.scene.scattering import (
    decay_per_mean_free_path,
    diffusion_length_mm,
    mean_free_path_mm,
    walk_albedo,
)

LIGHT, DARK = (0.5359, 0.3703, 0.2848), (0.055, 0.0374, 0.0321)


@pytest.mark.parametrize(
    ("albedo", "scattering_per_mm", "expected_mm"),
    [(0.5359, 2.11, 2.04), (0.2523, 2.55, 0.56), (0.0321, 3.40, 0.06)],
)
def test_light_dies_away_over_the_dipoles_length(
    albedo: float, scattering_per_mm: float, expected_mm: float
) -> None:
    assert diffusion_length_mm(albedo, scattering_per_mm) == pytest.approx(expected_mm, abs=0.006)


def test_the_decay_solves_transport() -> None:
    for single in (0.1, 0.5, 0.9, 0.99):
        decay = decay_per_mean_free_path(single)
        assert single / (2 * decay) * math.log((1 + decay) / (1 - decay)) == pytest.approx(1.0)
    # Diffusion's limit: sqrt(3 (1 - albedo)) where little is absorbed.
    assert decay_per_mean_free_path(0.9999) == pytest.approx(math.sqrt(3e-4), rel=1e-3)


def test_light_travels_less_far_in_darker_skin() -> None:
    dark, light = mean_free_path_mm(DARK), mean_free_path_mm(LIGHT)
    assert all(near < far for near, far in zip(dark, light, strict=True))
    assert light[0] > light[1] > light[2]
    assert 0.7 < light[0] < 1.1


@pytest.mark.parametrize("albedo", [0.0005, 0.004, 0.0165, 0.02, 0.5, 0.92, 0.99])
def test_every_albedo_has_a_mean_free_path(albedo: float) -> None:
    lengths = mean_free_path_mm((albedo, albedo, albedo))
    assert all(0.0 < length < 10.0 for length in lengths)


def test_where_little_is_scattered_light_dies_within_a_mean_free_path() -> None:
    decays = [decay_per_mean_free_path(single) for single in (0.3, 0.2, 0.1, 0.09, 0.001)]
    assert decays == sorted(decays)
    assert decays[-1] == 1.0
    assert decays[0] < 0.999


def test_a_walk_in_white_flesh_absorbs_nothing() -> None:
    assert walk_albedo(0.0) == 0.0
    assert walk_albedo(1.0) > 0.998
