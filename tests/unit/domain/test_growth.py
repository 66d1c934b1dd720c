"""What extends a dataset begins with it, and is as even as a dataset planned at once."""

import sys
from typing import Any

import numpy as np
import pytest

from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute

SMALL: dict[str, Any] = {"count": 100, "seed": 3}
TONES = ["light", "tan", "dark"]
PAIRS = 2.0
"""Images that a pair may be off its expectation."""


def planned(document: dict[str, Any]) -> Plan:
    return Plan.of(parse_spec(document))


def refused(document: dict[str, Any]) -> str:
    with pytest.raises(InvalidInput) as caught:
        parse_spec(document)
    return str(caught.value)


@pytest.mark.parametrize("count", [101, 144, 1000, 2500])
def test_a_larger_dataset_begins_with_the_smaller(count: int) -> None:
    small, large = planned(SMALL), planned({"count": count, "seed": 3, "extends": SMALL})
    assert list(large.cells(0, 100)) == list(small.cells())
    for attribute in large.crossed:
        counts = large.value_counts(attribute).values()
        assert sum(counts) == count
        assert max(counts) - min(counts) <= 1
    assert max(pair.furthest for pair in large.pair_ranges()) <= PAIRS


def test_growing_twice_keeps_both_beginnings() -> None:
    middle = {"count": 700, "seed": 3, "extends": SMALL}
    large = planned({"count": 1500, "seed": 3, "extends": middle})
    assert list(large.cells(0, 700)) == list(planned(middle).cells())


def test_new_values_catch_up() -> None:
    before = {**SMALL, "attributes": {"skin_tone": TONES[:2], "environment": ["city", "night"]}}
    asked = {
        "skin_tone": TONES,
        "environment": ["city", "night", "forest"],
        "ring": ["none", "gem"],
    }
    large = planned({"count": 600, "seed": 3, "attributes": asked, "extends": before})
    assert list(large.cells(0, 100)) == list(planned(before).cells())
    assert set(large.value_counts(Attribute.SKIN_TONE).values()) == {200}
    assert set(large.value_counts(Attribute.ENVIRONMENT).values()) == {200}
    assert set(large.value_counts(Attribute.RING).values()) == {300}
    assert max(pair.furthest for pair in large.pair_ranges()) <= PAIRS


def test_counts_of_a_larger_dataset_are_those_of_all_its_images() -> None:
    counts = {"female": 450, "male": 150}
    large = planned({"count": 600, "seed": 3, "attributes": {"gender": counts}, "extends": SMALL})
    assert large.value_counts(Attribute.GENDER) == counts


def test_what_is_added_is_fair_at_every_length() -> None:
    large = planned({"count": 900, "seed": 3, "extends": SMALL})
    rows = large.order.rows(np.arange(100, 900, dtype=np.int64))
    for place in range(len(large.crossed)):
        came = rows[:, place][:, None] == np.arange(int(rows[:, place].max()) + 1)
        steps = np.arange(1, 801)[:, None] * came.mean(axis=0)
        assert np.abs(np.cumsum(came, axis=0) - steps).max() <= large.order.stray


def test_cells_do_not_depend_on_how_they_are_asked_for() -> None:
    large = planned({"count": 300, "seed": 3, "extends": SMALL})
    cells = list(large.cells())
    assert [large.cell(index) for index in range(0, 300, 7)] == cells[::7]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"seed": 4}, "seed"),
        ({"image": {"width": 64}}, "image"),
        ({"labels": ["box"]}, "labels"),
        ({"count": 100}, "count"),
        ({"count": 2_000_000}, "count"),
        ({"twins": ["gender"]}, "twins"),
        ({"splits": {"by": "identity", "images": {"a": 100, "b": 100}}}, "splits"),
        ({"attributes": {"gender": ["female"]}}, "attributes.gender"),
        ({"attributes": {"gender": {"female": 180, "male": 20}}}, "attributes.gender"),
        ({"count": 101, "attributes": {"handedness": {"left": 101}}}, "attributes.handedness"),
        (
            {
                "combinations": [
                    {"of": {"gender": ["male"], "viewpoint": ["first_person"]}, "count": 9}
                ]
            },
            "combinations",
        ),
    ],
)
def test_what_cannot_extend_is_refused(changes: dict[str, Any], field: str) -> None:
    assert refused({"count": 200, "seed": 3, "extends": SMALL} | changes).startswith(f"{field}:")


def test_too_few_more_images_for_new_values_are_refused() -> None:
    before = {**SMALL, "attributes": {"skin_tone": TONES[:2]}}
    words = refused(
        {"count": 110, "seed": 3, "attributes": {"skin_tone": TONES}, "extends": before}
    )
    assert "There are 50 images of it already" in words


def test_a_problem_of_what_is_extended_is_named_by_its_place() -> None:
    words = refused({"count": 200, "extends": {"count": 100, "attributes": {"gender": ["x"]}}})
    assert words.startswith("extends.attributes.gender:")


def test_twins_cannot_have_more_values_than_the_scenes_that_are_there() -> None:
    three = {"count": 12, "twins": ["skin_tone"], "attributes": {"skin_tone": TONES}}
    more = {**three, "count": 48, "attributes": {"skin_tone": [*TONES, "brown"]}, "extends": three}
    assert refused(more).startswith("attributes.skin_tone:")
    genders = {"count": 200, "twins": ["gender", "skin_tone"]}
    two = {**genders, "attributes": {"skin_tone": TONES[:2]}}
    assert refused({**genders, "count": 600, "extends": two}).startswith("attributes.skin_tone:")


def test_a_value_without_images_may_be_dropped() -> None:
    before = {"count": 20, "attributes": {"gender": {"female": 20, "male": 0}}}
    after = {"count": 40, "attributes": {"gender": ["female"]}, "extends": before}
    assert list(planned(after).cells(0, 20)) == list(planned(before).cells())


def test_labels_in_another_order_are_the_same() -> None:
    before = {"count": 20, "labels": ["mask", "box"]}
    assert planned({"count": 40, "labels": ["box", "mask"], "extends": before}).count == 40


def test_many_generations_are_read_in_a_moment() -> None:
    weights = {f"part{k}": 1 for k in range(10)}
    document: dict[str, Any] = {
        "count": 600,
        "twins": ["skin_tone"],
        "splits": {"by": "identity", "images": {"weights": weights}},
    }
    for generation in range(1, 16):
        document = {**document, "count": 600 * (generation + 1), "extends": document}
    parsed = parse_spec(document)
    calls = 0

    def count(*_: object) -> None:
        nonlocal calls
        calls += 1

    sys.setprofile(count)
    parse_spec(document)
    sys.setprofile(None)
    assert parsed.count == 9600
    assert calls < 10_000_000  # hundreds of millions, when each generation was checked anew
