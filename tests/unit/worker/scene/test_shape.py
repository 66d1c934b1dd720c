"""The numbers of a hand's shape are spread as asked for, and inside the bands of its cell."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
import scipy.stats

from hi5_common.domain.plan import cell_of
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute
from services.worker.hand.shape import HandShape
from services.worker.scene.shape import draw_shape

HANDS = 4000
AT_CHANCE = 1.95 / HANDS**0.5
"""The Kolmogorov distance that one in a thousand samples of so many goes beyond."""


def drawn(distributions: Mapping[str, object], **bands: str) -> list[HandShape]:
    asked = parse_spec({"count": 60, "distributions": distributions}).distributions
    cell = cell_of({Attribute(name): band for name, band in bands.items()})
    return [draw_shape(cell, factor_rng(7, index, "shape"), asked) for index in range(HANDS)]


def distance(numbers: list[float], whole: Any, low: float, high: float) -> float:
    """Return how far the empirical distribution function is from that of `whole` cut to a band."""
    below, above = whole.cdf([low, high])
    assert low <= min(numbers)
    assert max(numbers) <= high
    return float(
        scipy.stats.kstest(numbers, lambda x: (whole.cdf(x) - below) / (above - below)).statistic
    )


def test_numbers_are_spread_as_asked_for() -> None:
    asked = {
        "age": {"normal": {"mean": 35, "sd": 10}},
        "weight": "uniform",
        "muscle": {"triangular": {"low": 0, "mode": 0.2, "high": 1}},
    }
    hands = drawn(asked, age="20..60", muscle="0.1..0.9")
    ages = [hand.age_years for hand in hands]
    assert distance(ages, scipy.stats.norm(35, 10), 20, 60) < AT_CHANCE
    assert distance(ages, scipy.stats.uniform(20, 40), 20, 60) > 5 * AT_CHANCE
    weights = [hand.weight for hand in hands]
    assert distance(weights, scipy.stats.uniform(0, 1), 0, 1) < AT_CHANCE
    muscles = [hand.muscle for hand in hands]
    assert distance(muscles, scipy.stats.triang(0.2), 0.1, 0.9) < AT_CHANCE


def test_what_is_not_asked_for_is_spread_as_ever() -> None:
    hands = drawn({}, hand_scale="-0.5..1")
    assert distance([h.age_years for h in hands], scipy.stats.uniform(18, 72), 18, 90) < AT_CHANCE
    assert distance([h.weight for h in hands], scipy.stats.norm(0.5, 0.2), 0, 1) < AT_CHANCE
    scale = scipy.stats.norm(0, 1 / 1.645)
    assert distance([h.scale for h in hands], scale, -0.5, 1) < AT_CHANCE


@pytest.mark.parametrize("index", range(20))
def test_one_distribution_moves_no_other_factor(index: int) -> None:
    cell = cell_of({Attribute.AGE: "20..60"})
    asked = parse_spec(
        {"count": 60, "distributions": {"age": {"normal": {"mean": 35, "sd": 10}}}}
    ).distributions
    before = asdict(draw_shape(cell, factor_rng(7, index, "shape"), {}))
    after = asdict(draw_shape(cell, factor_rng(7, index, "shape"), asked))
    assert before.pop("age_years") != after.pop("age_years")
    assert before == after
    assert np.all(np.isfinite(list(after.values())))
