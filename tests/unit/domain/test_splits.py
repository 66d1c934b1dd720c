"""Splits share nothing of what they are by, and each is balanced on its own."""

import json
from collections import Counter
from typing import Any

import pytest

from hi5_common.domain.balance import requested_counts
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.splits import poses_beside
from hi5_common.domain.vocabulary import Attribute, Pose

WEIGHTS = {"weights": {"train": 8, "val": 1, "test": 1}}


def planned(by: str, images: object, **more: object) -> Plan:
    document = {"count": 1000, "seed": 3, "splits": {"by": by, "images": images}}
    return Plan.of(parse_spec(document | more))


def by_split(plan: Plan) -> dict[str, list[dict[Attribute, str]]]:
    found: dict[str, list[dict[Attribute, str]]] = {}
    for index, cell in enumerate(plan.cells()):
        found.setdefault(str(plan.split_of(index)), []).append(cell.as_dict())
    return found


@pytest.mark.parametrize("by", ["environment", "pose"])
@pytest.mark.parametrize("images", [WEIGHTS, {"train": 850, "test": 150}])
def test_no_value_is_in_two_splits(by: str, images: object) -> None:
    plan = planned(by, images)
    parts = by_split(plan)
    values = [{cell[Attribute(by)] for cell in cells} for cells in parts.values()]
    assert sum(map(len, values)) == len(set.union(*values)) == len(plan.value_counts(Attribute(by)))
    assert {name: len(cells) for name, cells in parts.items()} == plan.split_counts()


@pytest.mark.parametrize("by", ["environment", "pose", "identity"])
def test_every_split_is_balanced_and_so_are_all_together(by: str) -> None:
    plan = planned(by, WEIGHTS)
    for attribute in plan.crossed:
        every = plan.value_counts(attribute)
        assert max(every.values()) - min(every.values()) <= 1
        for cells in by_split(plan).values():
            counts = Counter(cell[attribute] for cell in cells)
            share = 1 if attribute.value == by else len(every) - len(counts)
            assert max(counts.values()) - min(counts.values()) <= 1
            assert attribute.value == by or len(cells) < len(every) or share == 0


def test_counts_asked_for_are_met_in_all_and_shared_among_the_splits() -> None:
    asked = {"skin_tone": {"light": 700, "dark": 300}}
    plan = planned("environment", {"train": 901, "test": 99}, attributes=asked)
    assert plan.value_counts(Attribute.SKIN_TONE) == asked["skin_tone"]
    test = Counter(cell[Attribute.SKIN_TONE] for cell in by_split(plan)["test"])
    assert abs(test["dark"] - 29.7) < 1


def test_every_beginning_has_its_share_of_every_split() -> None:
    plan = planned("identity", WEIGHTS)
    came: Counter[str] = Counter()
    for index in range(plan.count):
        came[str(plan.split_of(index))] += 1
        assert abs(came["test"] - (index + 1) / 10) < 2
        assert abs(came["train"] - (index + 1) * 0.8) < 3


def test_a_hand_is_on_its_way_to_poses_of_its_split_only() -> None:
    spec = parse_spec({"count": 100, "splits": {"by": "pose", "images": WEIGHTS}})
    groups = {poses_beside(spec, pose, 0) for pose in Pose}
    assert len(groups) == 3
    assert sorted(pose for group in groups for pose in group) == sorted(Pose)
    assert poses_beside(parse_spec({"count": 100}), Pose.FIST, 0) == tuple(Pose)


def test_a_split_dataset_grows_and_every_image_stays_in_its_split() -> None:
    small = {"count": 1000, "seed": 3, "splits": {"by": "environment", "images": WEIGHTS}}
    large = {**small, "count": 2500, "extends": small}
    before, after = Plan.of(parse_spec(small)), Plan.of(parse_spec(large))
    assert list(after.cells(0, 1000)) == list(before.cells())
    assert [after.split_of(i) for i in range(1000)] == [before.split_of(i) for i in range(1000)]
    assert sum(after.split_counts().values()) == 2500
    for cells in by_split(after).values():
        counts = Counter(cell[Attribute.SKIN_TONE] for cell in cells)
        assert max(counts.values()) - min(counts.values()) <= 1


@pytest.mark.parametrize(
    ("splits", "more", "field"),
    [
        ({"by": "environment", "images": {"train": 900, "test": 90}}, {}, "splits.images"),
        ({"by": "environment", "images": {"train": 1000}}, {}, "splits.images"),
        ({"by": "environment", "images": {"train": 1000, "test": 0}}, {}, "splits.images.test"),
        ({"by": "environment", "images": {"Train!": 900, "test": 100}}, {}, "splits.images"),
        ({"by": "colour", "images": {"train": 900, "test": 100}}, {}, "splits.by"),
        (
            {"by": "pose", "images": WEIGHTS},
            {"attributes": {"pose": ["fist", "cup"]}},
            "splits.images",
        ),
        (
            {"by": "pose", "images": {"train": 900, "test": 100}},
            {"attributes": {"pose": {"fist": 900, "cup": 100}}},
            "splits.images",
        ),
        ({"by": "identity", "images": {"weights": {"a": 1e9, "b": 1}}}, {}, "splits.images"),
    ],
)
def test_what_cannot_be_split_is_refused(
    splits: dict[str, Any], more: dict[str, Any], field: str
) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse_spec({"count": 1000, "splits": splits} | more)
    assert str(caught.value).startswith(f"{field}:")


def test_a_plan_does_not_depend_on_the_order_in_which_splits_are_named() -> None:
    one = planned("environment", {"train": 850, "test": 150})
    other = planned("environment", {"test": 150, "train": 850})
    assert list(one.cells()) == list(other.cells())
    stored = parse_spec(json.loads(one.spec.canonical_json()))
    assert list(Plan.of(stored).cells()) == list(one.cells())
    assert [Plan.of(stored).split_of(i) for i in range(99)] == [one.split_of(i) for i in range(99)]


def test_a_split_may_stay_as_large_as_it_was() -> None:
    small = {"count": 100, "splits": {"by": "environment", "images": {"train": 80, "test": 20}}}
    images = {"train": 180, "test": 20}
    large = {"count": 200, "splits": {"by": "environment", "images": images}, "extends": small}
    before, after = Plan.of(parse_spec(small)), Plan.of(parse_spec(large))
    assert list(after.cells(0, 100)) == list(before.cells())
    assert by_split(after)["test"] == by_split(before)["test"]
    fewer = {**large, "splits": {"by": "environment", "images": {"train": 181, "test": 19}}}
    with pytest.raises(InvalidInput, match=r"^splits\.images\.test: 19"):
        parse_spec(fewer)


def test_a_later_split_keeps_the_values_that_it_has_one_more_of() -> None:
    by = {"by": "environment"}
    small = {"count": 12, "splits": {**by, "images": {"train": 8, "test": 4}}}
    images = {"train": 24, "test": 12}
    large = parse_spec({"count": 36, "splits": {**by, "images": images}, "extends": small})
    counts = Plan.of(large).value_counts(Attribute.POSE).values()
    assert max(counts) - min(counts) <= 1


def test_new_poses_leave_the_ways_of_old_images_alone() -> None:
    poses = [pose.value for pose in Pose]
    splits = {"by": "pose", "images": {"weights": {"train": 1, "test": 1}}}
    small = {"count": 40, "splits": splits, "attributes": {"pose": poses[:8]}}
    grown = {**small, "count": 200, "attributes": {"pose": poses[:16]}, "extends": small}
    before, after = parse_spec(small), parse_spec(grown)
    pools = [poses_beside(after, Plan.of(after).cell(index).pose, index) for index in range(40)]
    assert pools == [poses_beside(before, cell.pose, 0) for cell in Plan.of(before).cells()]


def test_requested_shares_of_what_is_split_are_those_of_each_split() -> None:
    environments = ["city", "night", "forest", "studio"]
    plan = planned(
        "environment", {"train": 950, "test": 50}, attributes={"environment": environments}
    )
    requested = requested_counts(plan.spec, Attribute.ENVIRONMENT)
    planned_counts = plan.value_counts(Attribute.ENVIRONMENT)
    assert all(abs(requested[v] - planned_counts[v]) < 1 for v in environments)


@pytest.mark.parametrize("weight", [float("inf"), float("nan"), 1e308, -1.0, True, "x"])
def test_weights_of_splits_are_sound_numbers(weight: object) -> None:
    images = {"weights": {"a": weight, "b": 1.0}}
    with pytest.raises(InvalidInput, match=r"^splits\.images\.a: "):
        parse_spec({"count": 40, "splits": {"by": "identity", "images": images}})


def test_images_that_are_no_map_are_refused_by_the_field() -> None:
    with pytest.raises(InvalidInput, match=r"^splits\.images: "):
        parse_spec({"count": 40, "splits": {"by": "identity", "images": [1, 2]}})
