"""How much of a skin is drawn follows from how large the hand is in the picture."""

import numpy as np
import pytest

from services.worker.hand.skinmaps.store import MapLevel
from services.worker.render.detail import MOST_PX_PER_M, Detail, detail_for, finer
from services.worker.scene.types import Camera, Intrinsics

AT_M = 0.5


def seen_at(pixels_per_m: float) -> Detail:
    focal_px = pixels_per_m * AT_M
    camera = Camera(Intrinsics(focal_px, focal_px, 160.0, 160.0, 320, 320), np.eye(4))
    keypoints_m = np.tile([0.0, 0.0, AT_M], (21, 1))
    return detail_for(camera, keypoints_m)


@pytest.mark.parametrize("level", list(MapLevel)[:-1])
def test_a_level_reaches_as_far_as_its_texels_do(level: MapLevel) -> None:
    most = MOST_PX_PER_M[level]
    assert seen_at(0.999 * most).level is level
    assert seen_at(1.001 * most).level == 2 * level


def test_the_largest_hands_have_the_finest_maps() -> None:
    assert seen_at(50_000.0).level is MapLevel.FINE


def test_small_hands_have_neither_pattern_nor_relief() -> None:
    small, near = seen_at(500.0), seen_at(4000.0)
    assert (small.level, small.pattern, small.relief) == (MapLevel.TINY, 0.0, False)
    assert (near.pattern, near.relief) == (1.0, True)
    shares = [seen_at(pixels).pattern for pixels in (900.0, 1500.0, 2000.0, 2500.0)]
    assert shares == sorted(shares)


def test_finer_is_one_level_up_to_the_finest() -> None:
    levels = [finer(Detail(level, 0.5, relief=True)).level for level in MapLevel]
    assert levels == [*list(MapLevel)[1:], MapLevel.FINE]
    assert finer(seen_at(4000.0)).pattern == 1.0
