"""The camera takes most of the light's colour out, and no light away."""

from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from services.worker.hand.skin import posed_hand
from services.worker.places.develop import LUMINANCE
from services.worker.scene.exposure import Seen, colour_on_hand
from services.worker.scene.geometry import transformed
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import Light, Rgb
from services.worker.scene.white_balance import (
    ADAPTED,
    MOST_STOPS,
    draw_adaptation,
    white_balance_of,
)

BLUE_SHADE: Rgb = (0.82, 1.0, 1.53)
LAMPLIGHT: Rgb = (1.7, 0.87, 0.226)


def test_neutral_light_is_left_alone() -> None:
    assert white_balance_of((1.0, 1.0, 1.0), 0.8) == (1.0, 1.0, 1.0)


@pytest.mark.parametrize("light", [BLUE_SHADE, LAMPLIGHT])
@pytest.mark.parametrize("adapted", [0.0, 0.5, 1.0])
def test_the_share_asked_for_is_taken_out_and_luminance_kept(light: Rgb, adapted: float) -> None:
    white = np.array(light) / float(np.array(light) @ LUMINANCE)
    shown = white * white_balance_of(tuple(white.tolist()), adapted)
    assert float(shown @ LUMINANCE) == pytest.approx(1.0, abs=2e-4)
    before, after = np.log2(white / white[1]), np.log2(shown / shown[1])
    short = np.abs(before) * adapted < MOST_STOPS - 0.2
    assert np.allclose(after[short], ((1.0 - adapted) * before)[short], atol=1e-3)
    assert (np.abs(after) <= np.abs(before) + 1e-6).all()


def test_a_coloured_lamp_keeps_its_colour() -> None:
    red = white_balance_of((4.0, 0.2, 0.08), 0.9)
    assert red[0] * 4.0 > 2.0 * red[1] * 0.2
    dark = white_balance_of((1.0 / float(LUMINANCE[0]), 0.0, 0.0), 1.0)
    assert np.isfinite(dark).all()


def test_adaptation_is_drawn_over_its_whole_range() -> None:
    rng = np.random.default_rng(3)
    drawn = [draw_adaptation(rng) for _ in range(400)]
    low, high = ADAPTED
    assert low <= min(drawn) < low + 0.02
    assert high - 0.02 < max(drawn) <= high


def test_gain_is_exposure_times_balance() -> None:
    light = Light("city", 0.0, 1.0, (0.5, 1.0, 2.0))
    assert light.gain.tolist() == [1.0, 2.0, 4.0]


def test_each_camera_takes_out_its_own_share_of_the_light_on_the_hand(tmp_path: Path) -> None:
    document = {"count": 6, "seed": 3, "attributes": {"environment": ["sunset", "courtyard"]}}
    spec = parse_spec(document | {"image": {"width": 64, "height": 64}})
    hands = HandLibrary(tmp_path)
    shares = []
    for index in range(spec.count):
        scene = sample_scene(spec, Plan.of(spec), index, hands)
        model = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape).model
        vertices_m = transformed(scene.hand_to_world, posed_hand(model, scene.angles).vertices_m)
        light, seen = scene.light, Seen(scene.camera, vertices_m, model.hand_quads())
        white = np.array(colour_on_hand(light.environment, light.rotation_z_deg, seen))
        shown = white * light.white_balance
        shares.append(1.0 - float(np.log(shown[2] / shown[0]) / np.log(white[2] / white[0])))
    low, high = ADAPTED
    assert all(low - 0.02 < share < high + 0.02 for share in shares)
    assert max(shares) - min(shares) > 0.05
