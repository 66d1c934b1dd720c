"""Conditional shares are met to less than an image, or refused with what would work."""

import ast
import itertools
import random
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from math import lcm
from typing import Any

import pytest
from ortools.sat.python import cp_model

from benchmarks.plan_evenness import furthest_beginning
from hi5_common.domain.balance import balance_of
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.outcomes import shared
from hi5_common.domain.plan import Plan
from hi5_common.domain.planning import order
from hi5_common.domain.records import Tallies
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import VALUES, Attribute

POSE, VIEWPOINT, TONE = Attribute.POSE, Attribute.VIEWPOINT, Attribute.SKIN_TONE
POSES = ["fist", "one", "five"]
VIEWS = ["first_person", "second_person", "third_person"]
Shares = dict[str, float] | list[str]


def given(pose: str, shares: Shares) -> dict[str, object]:
    return {"given": {"pose": [pose]}, "of": "viewpoint", "shares": shares}


def spec_of(count: int, *conditional: Mapping[str, object], **more: Any) -> DatasetSpec:
    attributes = {"environment": ["city", "night"], "pose": POSES, **more.pop("attributes", {})}
    document = {"count": count, "attributes": attributes, "conditional": list(conditional)}
    return parse_spec({**document, **more})


def images_of(spec: DatasetSpec) -> list[dict[str, int]]:
    """Count the images themselves."""
    cells = [cell.as_dict() for cell in Plan.of(spec).cells()]
    return [
        {
            value: sum(
                cell[asked.of] == value and all(cell[k] in some for k, some in asked.given.items())
                for cell in cells
            )
            for value in spec.values_of(asked.of)
        }
        for asked in spec.conditional
    ]


def test_shares_are_met_and_counts_that_were_asked_for_stay_exact() -> None:
    asked = {"viewpoint": {"first_person": 300, "second_person": 100, "third_person": 200}}
    spec = spec_of(600, given("fist", {"first_person": 3, "third_person": 1}), attributes=asked)
    assert images_of(spec) == [{"first_person": 150, "second_person": 0, "third_person": 50}]
    plan = Plan.of(spec)
    assert plan.value_counts(VIEWPOINT) == asked["viewpoint"]
    assert set(plan.value_counts(POSE).values()) == {200}
    assert furthest_beginning(plan.order, plan.count) <= 2.0 + 1e-9
    assert [one.images for one in shared(plan)] == images_of(spec)


def test_what_was_left_out_follows_and_is_equal_where_nothing_is_said() -> None:
    plan = Plan.of(spec_of(600, given("fist", {"first_person": 3, "third_person": 1})))
    pairs = plan.pair_counts(POSE, VIEWPOINT)
    assert [pairs["fist", view] for view in VIEWS] == [150, 0, 50]
    for pose in ("one", "five"):
        assert all(66 <= pairs[pose, view] <= 67 for view in VIEWS)
    assert furthest_beginning(plan.order, plan.count) <= 2.0 + 1e-9
    requested = balance_of(plan.spec, plan.tallies(), Tallies({}, {}), 0).attributes
    (views,) = (table for table in requested if table.attributes == (VIEWPOINT,))
    assert sum(cell.requested for cell in views.cells) == pytest.approx(600)
    assert views.worst_planned_deviation <= 1


def test_a_list_is_equal_shares_and_several_given_values_are_taken_together() -> None:
    both = {"given": {"pose": ["fist", "one"], "skin_tone": ["dark"]}, "of": "handedness"}
    spec = spec_of(600, {**both, "shares": ["left"]}, given("five", VIEWS[:2]))
    hands, views = images_of(spec)
    assert hands["right"] == 0
    assert hands["left"] > 0
    assert views == {"first_person": 100, "second_person": 100, "third_person": 0}
    counts = Plan.of(spec).value_counts(TONE)
    assert set(counts.values()) == {100}


def test_shares_follow_from_shares_that_follow() -> None:
    hands = {"given": {"gender": ["male"]}, "of": "handedness", "shares": {"left": 9, "right": 1}}
    views = {"given": {"handedness": ["left"]}, "of": "viewpoint", "shares": ["first_person"]}
    plan = Plan.of(spec_of(400, hands, views))
    assert plan.value_counts(Attribute.HANDEDNESS) == {"right": 120, "left": 280}
    of_left, first = shared(plan)[1].images, shared(plan)[1].images["first_person"]
    assert first == sum(of_left.values()) == 280


def test_shares_hold_where_a_woven_table_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(order, "WOVEN", 2000)
    spec = spec_of(9001, given("fist", {"first_person": 0.7, "third_person": 0.3}))
    found = images_of(spec)[0]
    whole = sum(found.values())
    assert len(Plan.of(spec).order.tables) == 2
    assert whole in {3000, 3001}
    assert abs(found["first_person"] - 0.7 * whole) < 1


def test_twins_share_as_scenes() -> None:
    spec = spec_of(240, given("fist", {"first_person": 3, "third_person": 1}), twins=["gender"])
    assert images_of(spec) == [{"first_person": 60, "second_person": 0, "third_person": 20}]


def test_older_specs_are_written_as_they_were_and_newer_ones_read_again() -> None:
    assert "conditional" not in parse_spec({"count": 3}).canonical_json()
    spec = spec_of(60, given("fist", VIEWS[:2]))
    assert DatasetSpec.model_validate_json(spec.canonical_json()) == spec


def tables(rows: Sequence[int], columns: Sequence[int]) -> Iterator[list[list[int]]]:
    """Yield all tables of whole numbers with these sums."""
    if len(rows) == 1:
        yield [list(columns)]
        return
    for first in itertools.product(*(range(n + 1) for n in columns)):
        if sum(first) == rows[0]:
            rest = [n - x for n, x in zip(columns, first, strict=True)]
            yield from ([list(first), *table] for table in tables(rows[1:], rest))


def nears(row: Sequence[int], weights: Sequence[int]) -> bool:
    whole = sum(row)
    return all(
        abs(x - Fraction(w * whole, sum(weights))) < 1 for x, w in zip(row, weights, strict=True)
    )


def test_small_specs_are_taken_just_when_some_table_of_all_there_are_meets_them() -> None:
    draw, taken = random.Random(3), Counter[bool]()
    for _ in range(150):
        count = draw.randint(3, 9)
        cuts = sorted(draw.randint(0, count) for _ in range(4))
        poses = [cuts[0], cuts[1] - cuts[0], count - cuts[1]]
        views = [cuts[2], cuts[3] - cuts[2], count - cuts[3]]
        asked = {
            pose: [draw.choice((0, 0, 1, 1, 2, 3)) for _ in VIEWS]
            for pose in draw.sample(POSES, draw.randint(1, 3))
        }
        asked = {pose: weights if any(weights) else [1, 1, 1] for pose, weights in asked.items()}
        possible = any(
            all(nears(table[POSES.index(pose)], weights) for pose, weights in asked.items())
            for table in tables(poses, views)
        )
        conditional = [
            given(pose, dict(zip(VIEWS, map(float, weights), strict=True)))
            for pose, weights in asked.items()
        ]
        counts = {
            "pose": dict(zip(POSES, poses, strict=True)),
            "viewpoint": dict(zip(VIEWS, views, strict=True)),
        }
        try:
            spec = spec_of(count, *conditional, attributes=counts)
        except InvalidInput:
            assert not possible
        else:
            assert possible
            for pose, found in zip(asked, images_of(spec), strict=True):
                assert nears(list(found.values()), asked[pose])
        taken[possible] += 1
    assert min(taken.values()) > 30


def can_be(document: dict[str, Any], kept: Sequence[str]) -> bool:
    """Ask CP-SAT whether the conditions `kept` of a spec can be met, and all counts."""
    model = cp_model.CpModel()
    attributes = {"viewpoint": None, **document["attributes"]}
    values = {name: list(asked or VIEWS) for name, asked in attributes.items()}
    names = list(values)
    cells = {
        cell: model.new_int_var(0, document["count"], str(cell))
        for cell in itertools.product(*values.values())
    }

    def images(listed: dict[str, Sequence[str]]) -> list[cp_model.IntVar]:
        return [
            n
            for cell, n in cells.items()
            if all(cell[names.index(name)] in some for name, some in listed.items())
        ]

    sum_of = cp_model.LinearExpr.sum
    model.add(sum_of(images({})) == document["count"])
    for name, found in values.items():
        asked, (share, extra) = attributes[name], divmod(document["count"], len(found))
        for value in found if asked else ():
            exact = asked[value] if isinstance(asked, dict) else None
            low, high = (share, share + bool(extra)) if exact is None else (exact, exact)
            model.add_linear_constraint(sum_of(images({name: [value]})), low, high)
    for number, one in enumerate(document["combinations"]):
        if f"combinations.{number}" in kept:
            model.add(sum_of(images(one["of"])) == one["count"])
    for number, one in enumerate(document["conditional"]):
        if f"conditional.{number}" not in kept:
            continue
        weights = {value: Fraction(str(w)) for value, w in one["shares"].items()}
        step = lcm(*(w.denominator for w in weights.values()))
        whole = int(sum(weights.values()) * step)
        among = images(one["given"])
        for value in values[one["of"]]:
            mine = images({**one["given"], one["of"]: [value]})
            steps = [whole] * len(mine) + [-int(weights.get(value, 0) * step)] * len(among)
            off = cp_model.LinearExpr.weighted_sum([*mine, *among], steps)
            model.add_linear_constraint(off, 1 - whole, whole - 1)
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    status = solver.solve(model)
    assert status in (cp_model.OPTIMAL, cp_model.INFEASIBLE)
    return status == cp_model.OPTIMAL


def drawn(draw: random.Random) -> dict[str, Any]:
    count = draw.randint(10, 60)
    cut = draw.randint(0, count)
    combinations = [
        {
            "of": {"pose": [draw.choice(POSES)], "gender": [draw.choice(["female", "male"])]},
            "count": draw.randint(0, count // 2),
        }
        for _ in range(draw.randint(0, 2))
    ]
    conditional = [
        {
            "given": {"pose": [pose]}
            if draw.random() < 0.6
            else {"gender": ["male"], "pose": draw.sample(POSES, 2)},
            "of": "viewpoint",
            "shares": {view: draw.choice((0.5, 1, 2.25, 3)) for view in draw.sample(VIEWS, 2)},
        }
        for pose in draw.sample(POSES, draw.randint(1, 3))
    ]
    return {
        "count": count,
        "attributes": {
            "gender": ["female", "male"],
            "skin_tone": ["tan"],
            "pose": POSES,
            "environment": ["night"],
            "handedness": ["left"],
            "viewpoint": VIEWS if draw.random() < 0.5 else dict.fromkeys(VIEWS, 0),
        }
        | {"pose": POSES if draw.random() < 0.5 else {"fist": cut, "one": count - cut, "five": 0}},
        "combinations": combinations,
        "conditional": conditional,
    }


def filled(document: dict[str, Any], draw: random.Random) -> dict[str, Any]:
    views = document["attributes"]["viewpoint"]
    if draw.random() < 0.25:
        del document["attributes"]["viewpoint"]
    elif isinstance(views, dict):
        a, b = sorted(draw.randint(0, document["count"]) for _ in range(2))
        views |= dict(zip(VIEWS, (a, b - a, document["count"] - b), strict=True))
    return document


CHANGE = re.compile(r"(combinations|conditional)\.(\d+)\.(count|shares): (\d+|{[^}]*}) instead of")


def test_random_specs_are_refused_just_when_a_solver_of_another_kind_finds_no_table() -> None:
    draw, outcomes = random.Random(11), Counter[str]()
    for _ in range(120):
        document = filled(drawn(draw), draw)
        every = [
            f"{field}.{number}"
            for field in ("combinations", "conditional")
            for number in range(len(document[field]))
        ]
        try:
            parse_spec(document)
        except InvalidInput as refused:
            assert not can_be(document, every)
            for problem in refused.problems:
                named = problem.remedy.split(" cannot")[0].split(", ")
                assert not can_be(document, named)
                for one in named:
                    assert can_be(document, [other for other in named if other != one])
                for field, number, part, now in CHANGE.findall(problem.remedy):
                    words = re.sub(r"(\w+):", r"'\1':", now)
                    document[field][int(number)][part] = ast.literal_eval(words)
            spec = parse_spec(document)
            outcomes["refused"] += 1
        else:
            spec = parse_spec(document)
            assert can_be(document, every)
            outcomes["taken"] += 1
        for asked, found in zip(spec.conditional, images_of(spec), strict=True):
            whole = sum(found.values())
            assert all(abs(n - asked.share(value) * whole) < 1 for value, n in found.items())
    assert min(outcomes["refused"], outcomes["taken"]) > 25


@pytest.mark.parametrize(
    ("asked", "field", "words"),
    [
        (given("fits", VIEWS), "conditional.0.given.pose", "no such value"),
        (given("fist", ["nobody"]), "conditional.0.shares", "no such value"),
        (given("fist", []), "conditional.0.shares", "a share above 0"),
        (given("fist", {"first_person": 0}), "conditional.0.shares", "a share above 0"),
        (given("fist", {"first_person": -1}), "conditional.0.shares.first_person", "or equal to 0"),
        (given("fist", VIEWS + VIEWS), "conditional.0.shares", "each value once"),
        ({**given("fist", VIEWS), "of": "pose"}, "conditional.0.given", "another than pose"),
        ({**given("fist", VIEWS), "given": {}}, "conditional.0.given", "at least one attribute"),
        ({**given("fist", ["gem"]), "of": "ring"}, "conditional.0.of", "Every image has none"),
        ({**given("fist", VIEWS), "of": "colour"}, "conditional.0.of", "gender"),
        ({**given("fist", VIEWS), "when": 1}, "conditional.0.when", "no such field"),
    ],
)
def test_what_is_not_a_condition_is_refused(
    asked: dict[str, object], field: str, words: str
) -> None:
    with pytest.raises(InvalidInput) as refused:
        spec_of(60, asked)
    assert refused.value.problems[0].field == field
    assert words in str(refused.value)


def test_shares_of_many_values_among_sets_that_overlap_are_refused() -> None:
    poses = {"given": {"gender": ["male"]}, "of": "pose", "shares": list(VALUES[POSE])}
    other = {**poses, "given": {"handedness": ["left"]}}
    with pytest.raises(InvalidInput, match=r"conditional\.0 and conditional\.1 both"):
        parse_spec({"count": 900, "conditional": [poses, other]})
    apart = {**poses, "given": {"gender": ["female"]}}
    assert len(parse_spec({"count": 900, "conditional": [poses, apart]}).conditional) == 2


def test_what_clashes_with_counts_is_refused_with_the_nearest() -> None:
    asked = given("fist", {"first_person": 3, "third_person": 1})
    with pytest.raises(InvalidInput) as refused:
        spec_of(120, asked, attributes={"pose": POSES[:2], "viewpoint": VIEWS})
    assert "conditional.0 cannot be met with the counts of pose, viewpoint" in str(refused.value)
    assert "conditional.0.shares: {first_person: 40, third_person: 20} instead of" in str(
        refused.value
    )


@pytest.mark.parametrize(
    "more",
    [
        {
            "twins": ["skin_tone"],
            "conditional": [{"given": {"skin_tone": ["dark"]}, "of": "pose", "shares": ["fist"]}],
        },
        {"splits": {"by": "identity", "images": {"train": 50, "test": 10}}},
        {"extends": {"count": 30, "attributes": {"environment": ["city"], "pose": POSES}}},
    ],
)
def test_twins_splits_and_growth_that_do_not_go_with_it_are_refused(more: dict[str, Any]) -> None:
    document = {"conditional": [given("fist", VIEWS)], **more}
    attributes = {"environment": ["city"], "pose": POSES}
    with pytest.raises(InvalidInput, match="conditional"):
        parse_spec({"count": 60, "attributes": attributes, **document})
