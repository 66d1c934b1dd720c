"""Keypoints in pixels against the oracle: ordinary scenes and hostile cameras."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from services.worker.hand.keypoints import TIPS, tip_flesh
from services.worker.hand.pose import posed_bones
from services.worker.hand.skin import posed_hand, unpressed
from services.worker.label.projection import to_camera, to_pixels
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import HandScene
from tests.unit.worker.label.oracle import oracle_px

ORDINARY_PX = 1e-6
PLACES = 300
"""Drawn scenes are taken from this many."""


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


def drawn(hands: HandLibrary, index: int) -> HandScene:
    spec = parse_spec({"count": PLACES, "seed": 5, "image": {"width": 640, "height": 640}})
    return sample_scene(spec, Plan.of(spec), index, hands)


def shifts_m(scene: HandScene, hands: HandLibrary) -> npt.NDArray[np.float64]:
    """What pressed flesh adds to the tips."""
    model = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape).model
    carried_m = unpressed(model, scene.angles, posed_bones(model, scene.angles))
    moved_m = posed_hand(model, scene.angles).vertices_m - carried_m
    shifts = np.zeros((21, 3))
    shifts[list(TIPS)] = tip_flesh(model) @ moved_m
    return shifts


def worst_px(scene: HandScene, hands: HandLibrary) -> float:
    """The farthest that a label's pixel is from the oracle's; both must agree on what is behind."""
    model = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape).model
    wanted = oracle_px(scene, model, shifts_m(scene, hands))
    keypoints_m = build_geometry(scene, hands).keypoints_m
    found = to_pixels(scene.camera.intrinsics, to_camera(scene.camera, keypoints_m))
    worst = 0.0
    for (x, y), place in zip(found.tolist(), wanted, strict=True):
        assert np.isnan(x) == (place is None)
        if place is not None:
            worst = max(worst, abs(float(place[0] - x)), abs(float(place[1] - y)))
    return worst


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
