"""What is said of times and errors."""

import math

import pytest

from services.worker.bench.errors import Errors
from services.worker.bench.figures import Measured, Result, pareto, seconds_at, speedups
from services.worker.bench.ways import Way, ablations, presets, straightforward
from services.worker.render.settings import Denoise, Prefilter, RenderSettings

PLAIN = RenderSettings(4, Denoise.NONE, Prefilter.NONE)


def result(name: str, seconds: float, psnr_db: float, index: int = 0) -> Result:
    errors = Errors(psnr_db, psnr_db, 0.01, 0.1, 0.0)
    rows = [{"total": seconds * f, "cycles_sample": 0.8 * seconds * f} for f in (0.9, 1.0, 1.2)]
    return Result(Way(name, PLAIN), (Measured(index, errors, rows),))


def test_a_way_that_another_beats_in_both_is_not_on_the_front() -> None:
    ways = [result("a", 1, 30), result("b", 2, 29), result("c", 3, 35), result("d", 3, 34)]
    assert [way.way.name for way in pareto(ways)] == ["a", "c"]


def test_times_are_medians_with_their_spread() -> None:
    scene = result("a", 2.0, 30).scenes[0]
    assert scene.seconds == 2.0
    assert scene.spread == pytest.approx(0.3)
    assert scene.overhead == pytest.approx(0.2)


def test_speed_is_compared_at_equal_error() -> None:
    plain = [result("4", 8.0, 30.0), result("16", 32.0, 36.0)]
    (found,) = speedups(result("ours", 2.0, 33.0), plain)
    assert found.ratio == pytest.approx(math.sqrt(8.0 * 32.0) / 2.0)
    assert not found.at_bound
    (better,) = speedups(result("ours", 2.0, 40.0), plain)
    assert better.ratio == 16.0
    assert better.at_bound


def test_times_between_points_are_log_linear() -> None:
    points = [(30.0, 1.0), (32.0, 4.0), (34.0, 16.0)]
    seconds, at_bound = seconds_at(31.0, points)
    assert seconds == pytest.approx(2.0)
    assert not at_bound
    assert seconds_at(29.0, points) == (1.0, True)


def test_every_way_has_a_name_of_its_own() -> None:
    names = [way.name for way in (*presets(), *straightforward((4, 8)), *ablations())]
    assert len(set(names)) == len(names)
    assert all(names)
