"""Twins differ in what was asked for and in nothing else of their cells."""

import itertools
from collections import Counter
from typing import Any

import pytest

from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute


@pytest.mark.parametrize(("twins", "size"), [(["skin_tone"], 6), (["skin_tone", "gender"], 12)])
def test_every_scene_comes_once_with_each_value(twins: list[str], size: int) -> None:
    plan = Plan.of(parse_spec({"count": 1200, "seed": 3, "twins": twins}))
    cells = [cell.as_dict() for cell in plan.cells()]
    for first in range(0, 1200, size):
        group = cells[first : first + size]
        assert len({tuple(cell[Attribute(name)] for name in twins) for cell in group}) == size
        rest = [{name: v for name, v in cell.items() if name not in twins} for cell in group]
        assert all(one == rest[0] for one in rest)
    for name in twins:
        assert len(set(plan.value_counts(Attribute(name)).values())) == 1


def test_pairs_and_counts_are_those_of_the_cells() -> None:
    document = {
        "count": 240,
        "twins": ["gender"],
        "attributes": {"viewpoint": {"first_person": 240}},
    }
    plan = Plan.of(parse_spec(document))
    cells = [cell.as_dict() for cell in plan.cells()]
    for (gender, pose), count in plan.pair_counts(Attribute.GENDER, Attribute.POSE).items():
        mine = [c for c in cells if (c[Attribute.GENDER], c[Attribute.POSE]) == (gender, pose)]
        assert len(mine) == count
    assert plan.value_counts(Attribute.VIEWPOINT) == {"first_person": 240}


def test_scenes_of_twins_are_split_and_grow_whole() -> None:
    small = {
        "count": 600,
        "twins": ["skin_tone"],
        "splits": {"by": "environment", "images": {"weights": {"train": 3, "test": 1}}},
    }
    plan = Plan.of(parse_spec({**small, "count": 1200, "extends": small}))
    assert list(plan.cells(0, 600)) == list(Plan.of(parse_spec(small)).cells())
    splits = [plan.split_of(index) for index in range(1200)]
    assert all(len(set(splits[first : first + 6])) == 1 for first in range(0, 1200, 6))
    assert {name: splits.count(name) for name in ("train", "test")} == plan.split_counts()


def test_more_images_than_are_woven_have_twins_too() -> None:
    attributes = {"environment": ["city", "night"], "pose": ["fist", "cup"]}
    spec = parse_spec({"count": 12_000_000, "twins": ["skin_tone"], "attributes": attributes})
    plan = Plan.of(spec)
    assert set(plan.value_counts(Attribute.SKIN_TONE).values()) == {2_000_000}
    assert len({plan.cell(11_999_994 + twin).skin_tone for twin in range(6)}) == 6
    smallest, largest = plan.joint_extremes()
    assert 0 < smallest <= 12_000_000 / 288 <= largest


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"count": 100, "twins": ["skin_tone"]}, "count"),
        ({"count": 120, "twins": ["pose"]}, "twins"),
        ({"count": 120, "twins": ["gender", "gender"]}, "twins"),
        (
            {"count": 120, "twins": ["gender"], "attributes": {"gender": ["male"]}},
            "attributes.gender",
        ),
        (
            {
                "count": 120,
                "twins": ["gender"],
                "attributes": {"gender": {"male": 60, "female": 60}},
            },
            "attributes.gender",
        ),
        (
            {"count": 120, "twins": ["gender"], "attributes": {"pose": {"fist": 61, "cup": 59}}},
            "attributes.pose.fist",
        ),
        (
            {
                "count": 120,
                "twins": ["gender"],
                "combinations": [{"of": {"gender": ["male"], "pose": ["fist"]}, "count": 2}],
            },
            "combinations.0.of",
        ),
        (
            {
                "count": 120,
                "twins": ["gender"],
                "splits": {"by": "identity", "images": {"a": 61, "b": 59}},
            },
            "splits.images.a",
        ),
    ],
)
def test_what_cannot_be_twins_is_refused(document: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse_spec(document)
    assert str(caught.value).startswith(f"{field}:")


def test_weights_are_met_in_whole_scenes_and_said_so() -> None:
    weights = {"weights": {"fist": 1.0, "cup": 0.5, "one": 3.0, "two": 1.0}}
    document = {"count": 24, "twins": ["skin_tone"], "attributes": {"pose": weights}}
    plan = Plan.of(parse_spec(document))
    assert plan.value_counts(Attribute.POSE) == plan.spec.counts_of(Attribute.POSE)


def test_sizes_are_worked_out_from_scenes() -> None:
    plan = Plan.of(parse_spec({"count": 240, "twins": ["gender", "skin_tone"]}))
    cells = [cell.as_dict() for cell in plan.cells()]
    for a, b in itertools.combinations(plan.crossed, 2):
        found = Counter((cell[a], cell[b]) for cell in cells)
        assert {pair: n for pair, n in plan.pair_counts(a, b).items() if n} == found
    joint = Counter(tuple(cell[name] for name in plan.crossed) for cell in cells)
    assert plan.joint_extremes() == (0, max(joint.values()))
