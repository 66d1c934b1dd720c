"""Keypoints in pixels against the oracle: ordinary scenes and hostile cameras."""

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.stability.against import PLACES, drawn, shifts_m, worst_px
from benchmarks.stability.oracle import oracle_px
from services.worker.scene.library import HandLibrary

ORDINARY_PX = 1e-6


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(index=st.integers(0, PLACES - 1))
def test_ordinary_scenes_agree_to_a_millionth_of_a_pixel(hands: HandLibrary, index: int) -> None:
    assert worst_px(drawn(hands, index), hands) < ORDINARY_PX


def test_the_oracle_notices_a_thousandth_of_a_degree(hands: HandLibrary) -> None:
    scene = drawn(hands, 3)
    model = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape).model
    wanted = oracle_px(scene, model, shifts_m(scene, hands))
    bent = replace(scene, angles=replace(scene.angles, wrist_flex=scene.angles.wrist_flex + 1e-3))
    moved = oracle_px(bent, model, shifts_m(scene, hands))
    apart = [abs(float(a[0] - b[0])) for a, b in zip(wanted, moved, strict=True) if a and b]
    assert max(apart) > 1e3 * ORDINARY_PX
