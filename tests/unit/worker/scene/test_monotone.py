"""The monotone cubic is scipy's, without scipy's import."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from services.worker.scene.monotone import monotone_cubic

GAPS = st.lists(st.floats(0.1, 50.0), min_size=2, max_size=8)
SHARES = st.floats(0.0, 1.0)


@given(GAPS, st.data())
def test_it_is_the_curve_of_scipy(gaps: list[float], data: st.DataObject) -> None:
    xs = [-90.0, *(-90.0 + np.cumsum(gaps))]
    size = len(xs)
    ys = data.draw(st.lists(st.floats(-3.0, 3.0), min_size=size, max_size=size))
    at = min(xs[0] + data.draw(SHARES) * (xs[-1] - xs[0]), xs[-1])
    wanted = float(PchipInterpolator(xs, ys)(at))
    assert monotone_cubic(at, xs, ys) == pytest.approx(wanted, abs=1e-9)


def test_it_meets_every_point() -> None:
    xs, ys = (0.0, 1.0, 4.0, 5.0), (2.0, -1.0, -1.0, 7.0)
    for x, y in zip(xs, ys, strict=True):
        assert monotone_cubic(x, xs, ys) == pytest.approx(y, abs=1e-12)


@pytest.mark.parametrize("at", [-0.1, 5.1, float("nan")])
def test_it_does_not_go_beyond_its_points(at: float) -> None:
    with pytest.raises(ValueError, match="outside"):
        monotone_cubic(at, (0.0, 1.0, 5.0), (2.0, 1.0, 7.0))
