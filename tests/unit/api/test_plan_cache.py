"""Plans that are kept: many small ones, or few large ones."""

import pytest

from hi5_common.domain.spec import DatasetSpec
from services.api.plans import cache
from services.api.plans.cache import Plans


def spec(count: int, seed: int = 0) -> DatasetSpec:
    return DatasetSpec(name="test", count=count, seed=seed)


def test_small_plans_are_kept_and_large_ones_make_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "IMAGES_KEPT", 30)
    plans = Plans()
    for seed in range(3):
        plans.of(spec(10, seed))
    plans.of(spec(10, 0))  # asked for last
    assert plans.made == 3
    plans.of(spec(20))  # in place of the two others
    plans.of(spec(10, 0))
    assert plans.made == 4
    plans.of(spec(10, 1))
    assert plans.made == 5


def test_one_that_is_larger_than_all_that_are_kept_is_kept_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cache, "IMAGES_KEPT", 30)
    plans = Plans()
    for count in (10, 40, 40):
        plans.of(spec(count))
    assert plans.made == 2
    plans.of(spec(10))
    assert plans.made == 3


def test_no_more_plans_are_kept_than_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "PLANS_KEPT", 2)
    plans = Plans()
    for seed in (0, 1, 2, 2, 1, 0):
        plans.of(spec(10, seed))
    assert plans.made == 4
