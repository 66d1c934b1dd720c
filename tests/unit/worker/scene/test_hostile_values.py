"""Values at the ends of their ranges: each is exact within a stated bound, or refused by name."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.compose.camera_look import shoulder, straightened
from services.worker.compose.picture import to_srgb8
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.hand.shape import HandShape
from services.worker.scene.colour import ita_deg, lab_to_linear_rgb, linear_rgb_to_lab
from services.worker.scene.path import between
from services.worker.scene.skin import HIGHEST_ALBEDO, LOWEST_ALBEDO, skin_of

AVERAGE = HandShape.average()


@given(st.floats(1e-12, 100.0), st.floats(0.0, 100.0))
def test_the_typology_angle_is_exact_up_to_its_poles(b: float, lightness: float) -> None:
    found = ita_deg((lightness, 0.0, b))
    # The other form of the same angle, which does not divide by b*.
    assert found == pytest.approx(math.degrees(math.atan2(lightness - 50.0, b)), abs=1e-9)
    assert -90.0 <= found <= 90.0


def test_it_is_zero_at_middle_lightness_and_refused_without_yellow() -> None:
    assert ita_deg((50.0, 10.0, 1e-300)) == 0.0
    for b in (0.0, -1e-300, -5.0):
        with pytest.raises(ValueError, match=r"b\* > 0"):
            ita_deg((60.0, 0.0, b))


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_colours_come_back_from_cielab(red: float, green: float, blue: float) -> None:
    back = lab_to_linear_rgb(linear_rgb_to_lab((red, green, blue)))
    assert np.abs(np.array(back) - (red, green, blue)).max() < 1e-12


@given(st.floats(-90.0, 70.0), st.integers(0, 2**32 - 1))
def test_every_drawn_skin_is_a_possible_albedo_of_the_asked_angle(
    angle_deg: float, seed: int
) -> None:
    skin = skin_of(angle_deg, 40.0, np.random.default_rng(seed))
    assert min(skin.dorsum_rgb) >= LOWEST_ALBEDO
    assert max(skin.dorsum_rgb) <= HIGHEST_ALBEDO
    lab = linear_rgb_to_lab(skin.dorsum_rgb)
    if abs(angle_deg) < 89.9:  # at the pole b* is nothing: the angle is 0/0 of rounding
        assert ita_deg(lab) == pytest.approx(angle_deg, abs=1e-6)
    assert all(0.0 < length < 100.0 for length in skin.mean_free_path_mm)


@pytest.mark.parametrize("angle_deg", [-90.0001, 70.0001, math.nan, math.inf])
def test_other_angles_are_refused(angle_deg: float) -> None:
    with pytest.raises(ValueError, match="ita_deg is"):
        skin_of(angle_deg, 40.0, np.random.default_rng(0))


@pytest.mark.parametrize("exposure_ev", [-20.0, -5.0, 0.0, 5.0, 20.0])
def test_any_exposure_gives_levels_in_order(exposure_ev: float) -> None:
    light = np.array([0.0, 1e-6, 1e-3, 0.18, 1.0, 1e5], np.float32)
    shown = to_srgb8(shoulder(light * np.float32(2.0**exposure_ev)))
    assert shown.dtype == np.uint8
    assert (np.diff(shown.astype(int)) >= 0).all()
    assert shown[0] == 0


def test_the_shoulder_is_undone_up_to_its_end() -> None:
    light = np.linspace(0.0, 15.0, 2000, dtype=np.float32)
    assert np.abs(straightened(shoulder(light)) / np.maximum(light, 1e-6) - 1.0)[1:].max() < 1e-4


@pytest.mark.parametrize(
    ("source", "target"), [(Pose.FIST, Pose.FIVE), (Pose.GOOD_LUCK, Pose.ROCKER)]
)
def test_steps_of_a_millionth_between_poses_jump_nowhere(source: Pose, target: Pose) -> None:
    """A hundred steps in each of ten places on the way."""
    step = 1e-6
    fastest = 0.0
    for place in np.linspace(0.0, 1.0 - 100 * step, 10):
        way = [
            between(Gender.FEMALE, AVERAGE, source, target, float(place + n * step))
            for n in range(101)
        ]
        angles = np.array([step_angles.as_array() for step_angles in way])
        assert np.isfinite(angles).all()
        assert max(np.abs(hard_limit_excess_deg(a)).max() for a in way[::25]) < 1e-9
        fastest = max(fastest, float(np.abs(np.diff(angles, axis=0)).max()))
    # No joint turns by more than a full turn on the whole way, swung out to a detour and back.
    assert fastest < 1000.0 * step


@pytest.mark.parametrize("t", [-1e-9, 1.0 + 1e-9, math.nan])
def test_places_off_the_way_are_refused(t: float) -> None:
    with pytest.raises(ValueError, match="t is"):
        between(Gender.MALE, AVERAGE, Pose.FIST, Pose.FIVE, t)
