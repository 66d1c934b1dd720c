"""The presets are specs, one inside the other."""

import pytest

from hi5_common.domain.ordering import numbered
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.splits import parts
from hi5_common.presets import NAMES, preset

COUNTS = {"hi5-small": 10_000, "hi5-medium": 100_000, "hi5-large": 583_643}


@pytest.mark.parametrize("name", NAMES)
def test_a_preset_is_a_spec_of_its_size(name: str) -> None:
    spec = preset(name)
    assert parse_spec(spec.model_dump(mode="json")) == spec
    assert (spec.name, spec.count) == (name, COUNTS[name])


def test_each_extends_the_one_before() -> None:
    assert preset("hi5-large").extends == preset("hi5-medium")
    assert preset("hi5-medium").extends == preset("hi5-small")
    assert preset("hi5-small").extends is None


def test_the_largest_has_the_papers_sizes() -> None:
    assert {name: part.count for name, part in parts(preset("hi5-large")).items()} == {
        "train": 538_643,
        "test": 45_000,
    }


def test_the_medium_one_begins_with_the_small_one() -> None:
    small, medium = Plan.of(preset("hi5-small")), Plan.of(preset("hi5-medium"))
    assert list(medium.cells(0, 10_000)) == list(small.cells())
    assert max(pair.furthest for pair in medium.pair_ranges()) < 2.0
    assert medium.order is numbered(preset("hi5-medium")).order


def test_there_are_no_others() -> None:
    with pytest.raises(KeyError):
        preset("hi5-huge")
