"""Rotations at the places where formulas for them break."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.worker.hand.model import F8
from services.worker.hand.rotation import about, around, matrices, quaternions, swing, unit

ANGLES_DEG = st.one_of(
    st.floats(-720.0, 720.0), st.sampled_from([0.0, 180.0, -180.0, 179.9999999, 1e-9, 360.0])
)
AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: sum(map(abs, axis)) > 1e-3)
EXACT = 1e-14


def turned(axis: tuple[float, float, float], angle_deg: float) -> F8:
    return about(np.array(axis), angle_deg)


@given(AXES, ANGLES_DEG)
def test_a_rotation_stays_one_through_a_quaternion(
    axis: tuple[float, float, float], angle_deg: float
) -> None:
    rotation = turned(axis, angle_deg)
    assert np.abs(rotation @ rotation.T - np.eye(3)).max() < EXACT
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=EXACT)
    quaternion = quaternions(rotation[None])
    assert np.abs(matrices(quaternion)[0] - rotation).max() < 2 * EXACT


@given(AXES, ANGLES_DEG)
def test_both_quaternions_of_a_rotation_are_that_rotation(
    axis: tuple[float, float, float], angle_deg: float
) -> None:
    quaternion = quaternions(turned(axis, angle_deg)[None])
    assert np.array_equal(matrices(quaternion), matrices(-quaternion))


@given(AXES, AXES)
def test_a_swing_takes_one_direction_to_the_other(
    start: tuple[float, float, float], end: tuple[float, float, float]
) -> None:
    a, b = unit(np.array(start)), unit(np.array(end))
    if np.linalg.norm(a + b) < 1e-6:
        return
    assert np.abs(swing(a, b) @ a - b).max() < 1e-9


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-9, 1e-12])
def test_nearly_opposite_directions_still_swing(off: float) -> None:
    a, b = np.array([0.0, 1.0, 0.0]), unit(np.array([off, -1.0, 0.0]))
    assert np.abs(swing(a, b) @ a - b).max() < 1e-12


def test_opposite_directions_are_refused() -> None:
    with pytest.raises(ValueError, match="opposite"):
        swing(np.array([0.0, 2.0, 0.0]), np.array([0.0, -1.0, 0.0]))


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1.0, 1e3, 1e9])
def test_a_chain_of_joints_scales_with_its_bones(size: float) -> None:
    """Thirty joints of any size end where the same joints of size one do, times the size."""
    rng = np.random.default_rng(0)
    axes, turns = rng.normal(size=(30, 3)), rng.uniform(-90.0, 90.0, 30)
    heads = np.cumsum(rng.normal(size=(30, 3)), axis=0)

    def end(scale: float) -> F8:
        chain = np.eye(4)
        for head, axis, turn in zip(heads * scale, axes, turns, strict=True):
            chain = chain @ around(head, about(axis, float(turn)))
        return chain[:3, 3]

    apart = np.linalg.norm(end(size) / size - end(1.0))
    assert apart < 1e-13 * np.linalg.norm(heads)
