"""Pictures of a skin: the mixture of the maps, its nails, and no pattern where none is seen."""

from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.seeding import factor_rng
from services.worker.hand.skinmaps.maps import SkinMaps
from services.worker.hand.skinmaps.planes import HEIGHTS, MARKS, PLANES, Plane, scale_of
from services.worker.scene.skin import base_rgb, skin_of
from services.worker.scene.skin_paint import FREE_EDGE_RGB, NAIL_COAT, painted
from services.worker.scene.types import NailPolish, Skin

SIDE_PX = 64


@pytest.fixture(scope="module")
def maps() -> SkinMaps:
    rng = factor_rng(1, 0, "maps")
    marks = rng.integers(0, 256, (len(MARKS), SIDE_PX, SIDE_PX)).astype(np.uint8)
    heights = rng.integers(-3000, 3000, (len(HEIGHTS), SIDE_PX, SIDE_PX)).astype(np.int16)
    marks[MARKS.index(Plane.NAIL)] = 0
    marks[MARKS.index(Plane.NAIL), :8] = 255
    return SkinMaps(marks, heights, rng.uniform(-0.2, 1.0, (64, len(PLANES))).astype(np.float32))


def value(maps: SkinMaps, plane: Plane) -> np.ndarray:
    step, zero = scale_of(plane)
    return np.asarray(step * (maps.plane(plane).astype(np.float64) - zero))


def drawn(age_years: float = 70.0) -> Skin:
    return skin_of(28.0, age_years, factor_rng(5, 0, "skin"))


def test_pictures_are_the_weighted_sum_of_the_maps(maps: SkinMaps) -> None:
    skin = drawn()
    picture = painted(skin, maps, 1.0)
    log_albedo = np.tile(np.log(base_rgb(skin, maps.dorsum)), (SIDE_PX, SIDE_PX, 1))
    for layer in skin.pigment.layers:
        for plane, weight in layer.mix:
            log_albedo += weight * value(maps, plane)[..., None] * np.array(layer.rgb)
    assert np.allclose(picture.albedo[8:, :, :3], np.exp(log_albedo)[8:], rtol=3e-3)
    slack = sum(weight * value(maps, plane) for plane, weight in skin.relief.slack)
    assert np.allclose(picture.relief[..., 1], slack, atol=1e-3)


def test_no_pattern_is_drawn_where_none_is_seen(maps: SkinMaps) -> None:
    whole, thin = painted(drawn(), maps, 1.0), painted(drawn(), maps, 0.0)
    weight = dict(drawn().relief.still)[Plane.PATTERN]
    apart = whole.relief[..., 0] - thin.relief[..., 0]
    assert np.allclose(apart, weight * value(maps, Plane.PATTERN), atol=1e-4)
    assert np.array_equal(whole.relief[..., 1:], thin.relief[..., 1:])


def test_nails_have_a_bed_a_white_edge_and_gloss(maps: SkinMaps) -> None:
    skin = drawn()
    picture = painted(skin, maps, 1.0)
    along, nail = value(maps, Plane.NAIL_ALONG)[:8], picture.albedo[:8, :, :3]
    assert np.allclose(nail[along > skin.nail_edge_from + 0.06], FREE_EDGE_RGB, atol=1e-3)
    bed = nail[(along < skin.nail_edge_from - 0.5) & (value(maps, Plane.LUNULA)[:8] < 0.05)]
    assert np.abs(bed - np.array(skin.nail_rgb)).max() < 0.02
    assert np.allclose(picture.relief[:8, :, 2], NAIL_COAT)
    assert (picture.relief[8:, :, 2] == 0.0).all()


def test_polish_covers_bed_and_edge_and_clear_polish_neither(maps: SkinMaps) -> None:
    red = painted(replace(drawn(), nail_polish=NailPolish((0.5, 0.02, 0.03), 0.1)), maps, 1.0)
    assert np.allclose(red.albedo[:8, :, :3], (0.5, 0.02, 0.03), atol=1e-4)
    clear = painted(replace(drawn(), nail_polish=NailPolish(None, 0.1)), maps, 1.0)
    assert np.array_equal(clear.albedo[..., :3], painted(drawn(), maps, 1.0).albedo[..., :3])
    assert np.allclose(clear.relief[:8, :, 2], 1.0)
