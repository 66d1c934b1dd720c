"""Real bakes in Blender's own process, a few texels wide."""

from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.environments import CATALOGUE
from services.worker.places.bakery import Oven
from services.worker.places.develop import LUMINANCE, MAX_RADIANCE, mean_rgb
from services.worker.places.exr import read_panorama
from services.worker.render.blender.places.photograph import closed

pytestmark = pytest.mark.render


@pytest.mark.parametrize("environment", ["beach_sunset", "kitchen_evening"])
def test_a_place_is_baked_to_its_level(environment: str, tmp_path: Path) -> None:
    entry = CATALOGUE[environment]
    Oven(2, 64).bake(entry, tmp_path / "one.exr")
    panorama = read_panorama(tmp_path / "one.exr")
    assert panorama.shape == (32, 64, 3)
    assert panorama.min() >= 0.0
    assert panorama.max() <= MAX_RADIANCE
    level = float(mean_rgb(panorama) @ LUMINANCE)
    assert level == pytest.approx(entry.luminance, rel=0.01)
    assert float(np.std(panorama[:16] @ LUMINANCE)) > 0.01  # a picture, not a flat void


def test_a_bake_does_not_depend_on_the_number_of_threads(tmp_path: Path) -> None:
    entry = CATALOGUE["lake_noon"]
    for threads in (1, 2):
        Oven(threads, 64).bake(entry, tmp_path / f"{threads}.exr")
    assert (tmp_path / "1.exr").read_bytes() == (tmp_path / "2.exr").read_bytes()


def test_the_two_ends_of_a_panorama_meet() -> None:
    # Two renders of the same directions that differ, as a denoiser's do.
    wide = np.linspace(1.0, 3.0, 40, dtype=np.float32)[None, :, None].repeat(2, axis=0)
    turn = closed(wide, 4)
    assert turn.shape == (2, 32, 1)
    steps = np.abs(np.diff(np.concatenate([turn, turn[:, :1]], axis=1), axis=1))
    assert steps.max() < 0.3  # without the mixing the ends are 1.6 apart
    assert np.array_equal(turn[:, 4:-4], wide[:, 8:-8])
