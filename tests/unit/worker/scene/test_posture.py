"""A still looks like the pose that it is counted as."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Gender, Handedness
from services.worker.hand.angles import ANGLE_INDEX
from services.worker.hand.shape import HandShape
from services.worker.scene.library import HandLibrary
from services.worker.scene.motion import MOTIONS
from services.worker.scene.path import goes_round
from services.worker.scene.poses import solved_angles
from services.worker.scene.posture import MAX_BLEND, MAX_BLEND_ROUND, Posture, draw_posture

FIRST_JOINTS = [
    ANGLE_INDEX[f"{finger}_pip_flex"] for finger in ("index", "middle", "ring", "pinky")
]


@pytest.fixture(scope="module")
def postures(tmp_path_factory: pytest.TempPathFactory) -> list[Posture]:
    spec = parse_spec({"count": 132, "seed": 8, "attributes": {"gender": ["male"]}})
    hands = HandLibrary(Path(tmp_path_factory.mktemp("cache")))
    model = hands.hand(Gender.MALE, Handedness.RIGHT).model
    cells = enumerate(Plan.of(spec).cells())
    shape = HandShape.average()
    return [draw_posture(cell, shape, model, partial(factor_rng, 8, i)) for i, cell in cells]


def test_a_hand_that_goes_round_has_hardly_set_out(postures: list[Posture]) -> None:
    ways = {goes_round(posture.blend.source, posture.blend.target) for posture in postures}
    assert ways == {True, False}
    for posture in postures:
        round_about = goes_round(posture.blend.source, posture.blend.target)
        assert posture.blend.t <= (MAX_BLEND_ROUND if round_about else MAX_BLEND)


def test_fingers_stay_bent_as_their_pose_bends_them(postures: list[Posture]) -> None:
    for posture in postures:
        pose = solved_angles(Gender.MALE, posture.blend.source, HandShape.average())
        strayed = (posture.angles.as_array() - pose.as_array())[FIRST_JOINTS]
        assert np.abs(strayed).max() < 45.0, posture.blend


def test_only_motions_have_a_phase(postures: list[Posture]) -> None:
    assert all(
        (posture.phase is None) == (posture.blend.source not in MOTIONS) for posture in postures
    )
    assert any(posture.phase is not None for posture in postures)
