import numpy as np
import pytest

from services.worker.label.outline import coverage, filter_taps
from services.worker.label.projected import project_mesh
from services.worker.label.raster import rasterise
from services.worker.render.rect import PixelRect
from tests.unit.worker.label.shapes import CAMERA, LENS, box, scene_of

WHOLE = PixelRect(0, 0, LENS.width_px, LENS.height_px)


def test_the_filter_is_even_and_adds_up_to_one() -> None:
    taps = filter_taps()
    assert taps == pytest.approx(taps[::-1])
    assert taps.sum() == pytest.approx(1.0, abs=1e-6)
    assert (np.diff(taps[: len(taps) // 2]) > 0.0).all()


def test_a_straight_side_is_crossed_as_the_filter_says() -> None:
    # The front face lies at 0.8 m: 31.5 ± 12.5 by 20.25 ± 5 pixels, its left side at x = 19.
    geometry = scene_of([box((0.0, 0.0, 1.0), (0.1, 0.05, 0.2))], [0])
    share = coverage(rasterise(project_mesh(CAMERA, geometry)), WHOLE)
    assert share is not None
    row = share[20]
    assert (row[:18] == 0.0).all()
    assert row[20:43] == pytest.approx(1.0, abs=1e-6)
    assert row[18] + row[19] == pytest.approx(1.0, abs=1e-5)  # the side is half way between them
    assert 0.0 < row[18] < 0.25
    # y = 15.25 is half a quarter of a pixel from a pixel's border: what is covered adds up.
    assert share[:, 31].sum() == pytest.approx(10.0, abs=0.13)


def test_a_region_is_a_part_of_the_picture() -> None:
    geometry = scene_of([box((0.02, 0.01, 1.0), (0.1, 0.05, 0.2))], [0])
    surface = rasterise(project_mesh(CAMERA, geometry))
    whole = coverage(surface, WHOLE)
    assert whole is not None
    part = PixelRect(10, 12, 40, 30)
    cut = coverage(surface, part)
    assert cut is not None
    assert np.array_equal(cut, whole[part.slices])


def test_a_hand_that_leaves_the_picture_is_whole_to_its_border() -> None:
    geometry = scene_of([box((0.0, 0.0, 1.0), (2.0, 0.05, 0.2))], [0])
    share = coverage(rasterise(project_mesh(CAMERA, geometry)), WHOLE)
    assert share is not None
    assert (share == share[:, 31:32]).all()
    assert share[20, 0] == 1.0


def test_a_mesh_that_reaches_behind_the_lens_is_not_measured() -> None:
    surface = rasterise(
        project_mesh(CAMERA, scene_of([box((0.0, 0.0, 0.0), (0.1, 0.1, 0.2))], [0]))
    )
    assert coverage(surface, WHOLE) is None
