"""Coverage is met by every plan, or refused with what would work."""

import random
from collections import Counter
from collections.abc import Sequence
from typing import Any

import pytest
from ortools.sat.python import cp_model

from hi5_common.domain import coverage, ordering
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.outcomes import covered
from hi5_common.domain.plan import Plan
from hi5_common.domain.planning.order import Order
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import Attribute

PLACES = ["city", "forest", "night"]
POSES = ["fist", "one", "five"]


def every(at_least: int, *of: str) -> dict[str, object]:
    return {"of": list(of), "at_least": at_least}


def spec_of(count: int, *asked: dict[str, object], **more: Any) -> DatasetSpec:
    attributes = {"environment": PLACES, "pose": POSES, **more.pop("attributes", {})}
    return parse_spec({"count": count, "attributes": attributes, "coverage": list(asked), **more})


def rarest(plan: Plan) -> list[int]:
    """Count the images of every combination themselves."""
    cells = [cell.as_dict() for cell in plan.cells()]
    found = []
    for asked in plan.spec.coverage:
        times = Counter(tuple(cell[name] for name in asked.of) for cell in cells)
        combinations = 1
        for name in asked.of:
            combinations *= len(plan.spec.values_of(name))
        found.append(min(times.values()) if len(times) == combinations else 0)
    return found


def missed(monkeypatch: pytest.MonkeyPatch) -> list[Order]:
    """Take what is woven first for short of all coverage; return all that is woven."""
    woven, real = list[Order](), coverage.short

    def short(spec: DatasetSpec, order: Order, crossed: Sequence[Attribute]) -> frozenset[int]:
        woven.append(order)
        every = frozenset(range(len(spec.coverage)))
        return every if len(woven) == 1 else real(spec, order, crossed)

    ordering._numbered.cache_clear()
    monkeypatch.setattr(coverage, "short", short)
    return woven


@pytest.mark.parametrize("linked", [False, True])
def test_every_pose_is_in_every_place_at_least_twice(
    linked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    woven = missed(monkeypatch) if linked else []
    spec = parse_spec({"count": 9768, "coverage": [every(2, "pose", "environment")]})
    plan = Plan.of(spec)
    (found,) = covered(plan)
    assert (found.smallest, found.largest) == (2, 2)
    assert rarest(plan) == [2]
    assert len(woven) == 2 * linked
    for attribute in (Attribute.POSE, Attribute.ENVIRONMENT, Attribute.SKIN_TONE):
        counts = plan.value_counts(attribute).values()
        assert max(counts) - min(counts) <= 1


@pytest.mark.parametrize("linked", [False, True])
def test_three_attributes_are_covered_beside_others(
    linked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    woven = missed(monkeypatch) if linked else []
    asked = [every(1, "gender", "skin_tone", "pose"), every(20, "pose", "environment")]
    plan = Plan.of(spec_of(200, *asked))
    assert len(woven) == 2 * linked
    assert all(n >= one.at_least for n, one in zip(rarest(plan), plan.spec.coverage, strict=True))


def test_what_the_weave_would_miss_is_linked() -> None:
    """One place has as many images as it must, which independence would not give it."""
    asked = every(3, "skin_tone", "pose", "environment")
    places = {"city": 54, "forest": 54, "night": 400}
    spec = spec_of(508, asked, attributes={"environment": places})
    without = Plan.of(parse_spec(spec.model_dump(mode="json") | {"coverage": []}))
    crossed = [without.crossed.index(name) for name in spec.coverage[0].of]
    assert coverage.fewest(without.order, crossed) < 3
    assert rarest(Plan.of(spec)) == [3]


def test_coverage_goes_with_combinations_and_conditional_shares() -> None:
    spec = spec_of(
        300,
        every(4, "pose", "environment"),
        every(5, "viewpoint", "pose"),
        combinations=[{"of": {"pose": ["fist"], "environment": ["night"]}, "count": 4}],
        conditional=[
            {
                "given": {"pose": ["fist"]},
                "of": "viewpoint",
                "shares": {"first_person": 90, "second_person": 5, "third_person": 5},
            }
        ],
    )
    plan = Plan.of(spec)
    assert rarest(plan) == [4, 5]
    assert plan.pair_counts(Attribute.POSE, Attribute.ENVIRONMENT)["fist", "night"] == 4


def test_twins_are_covered_as_scenes() -> None:
    plan = Plan.of(spec_of(120, every(9, "pose", "environment"), twins=["gender"]))
    assert rarest(plan)[0] >= 10
    with pytest.raises(InvalidInput, match="Every scene has every gender"):
        spec_of(120, every(9, "pose", "gender"), twins=["gender"])
    with pytest.raises(InvalidInput, match="the twins of a scene, are counted as one"):
        spec_of(120, every(15, "pose", "environment"), twins=["gender"])


def test_older_specs_are_written_as_they_were() -> None:
    assert "coverage" not in parse_spec({"count": 3}).canonical_json()
    spec = spec_of(60, every(1, "pose", "environment"))
    assert DatasetSpec.model_validate_json(spec.canonical_json()) == spec


def can_be(document: dict[str, Any]) -> bool:
    """Ask CP-SAT whether images can be laid as a spec has it."""
    model, asked, count = cp_model.CpModel(), document["attributes"], document["count"]
    cells = {
        (tone, pose, place): model.new_int_var(0, count, f"{tone} {pose} {place}")
        for tone in asked["skin_tone"]
        for pose in asked["pose"]
        for place in asked["environment"]
    }
    names = ("skin_tone", "pose", "environment")

    def images(listed: dict[str, str]) -> cp_model.LinearExprT:
        mine = [
            n
            for cell, n in cells.items()
            if all(cell[names.index(name)] == value for name, value in listed.items())
        ]
        return cp_model.LinearExpr.sum(mine)

    model.add(images({}) == count)
    for name in names:
        share, extra = divmod(count, len(asked[name]))
        for value in asked[name]:
            exact = asked[name][value] if isinstance(asked[name], dict) else None
            low, high = (share, share + bool(extra)) if exact is None else (exact, exact)
            model.add_linear_constraint(images({name: value}), low, high)
    for one in document["combinations"]:
        model.add(images({name: values[0] for name, values in one["of"].items()}) == one["count"])
    for one in document["coverage"]:
        a, b = one["of"]
        for x in asked[a]:
            for y in asked[b]:
                model.add(images({a: x, b: y}) >= one["at_least"])
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    status = solver.solve(model)
    assert status in (cp_model.OPTIMAL, cp_model.INFEASIBLE)
    return status == cp_model.OPTIMAL


def drawn(draw: random.Random) -> dict[str, Any]:
    count = draw.randint(20, 60)
    a, b = sorted(draw.randint(1, count - 1) for _ in range(2))
    uneven = dict(zip(PLACES, (a, b - a, count - b), strict=True))
    pairs = [["skin_tone", "pose"], ["pose", "environment"], ["skin_tone", "environment"]]
    return {
        "count": count,
        "attributes": {
            "gender": ["male"],
            "handedness": ["left"],
            "viewpoint": ["first_person"],
            "skin_tone": ["tan", "dark"],
            "pose": POSES,
            "environment": PLACES if draw.random() < 0.5 else uneven,
        },
        "combinations": [
            {"of": {"pose": ["fist"], "environment": ["night"]}, "count": draw.randint(0, 8)}
        ]
        * draw.randint(0, 1),
        "coverage": [
            {"of": pair, "at_least": draw.randint(1, 1 + count // 9)}
            for pair in draw.sample(pairs, draw.randint(1, 3))
        ],
    }


def test_random_specs_are_covered_or_refused_just_when_no_table_covers_them() -> None:
    draw, outcomes = random.Random(5), Counter[bool]()
    for _ in range(120):
        document = drawn(draw)
        possible = can_be(document)
        outcomes[possible] += 1
        if not possible:
            with pytest.raises(InvalidInput, match=r"coverage|combinations"):
                parse_spec(document)
            continue
        spec = parse_spec(document)
        assert all(
            n >= one.at_least for n, one in zip(rarest(Plan.of(spec)), spec.coverage, strict=True)
        )
    assert min(outcomes.values()) > 25


@pytest.mark.parametrize(
    ("count", "asked", "more", "field", "words"),
    [
        (17, every(2, "pose", "environment"), {}, "at_least", "need 18 images, and count is 17"),
        (17, every(2, "pose", "environment"), {}, "at_least", "can have is at_least 1"),
        (8, every(1, "pose", "environment"), {}, "at_least", "cannot have every combination"),
        (
            60,
            every(2, "pose", "environment"),
            {"attributes": {"pose": {"fist": 5, "one": 30, "five": 25}}},
            *("at_least", "pose fist has 5 images, and its 3 combinations need 6"),
        ),
        (60, every(1, "pose", "pose"), {}, "of", "each attribute once"),
        (60, every(1, "pose", "ring"), {}, "of", "Every image has none"),
        (60, every(1, "pose"), {}, "of", "at least 2 items"),
        (60, every(0, "pose", "gender"), {}, "at_least", "greater than or equal to 1"),
        (60, every(1, "pose", "colour"), {}, "of.1", "gender"),
    ],
)
def test_what_cannot_be_covered_is_refused(
    count: int, asked: dict[str, object], more: dict[str, Any], field: str, words: str
) -> None:
    with pytest.raises(InvalidInput) as refused:
        spec_of(count, asked, **more)
    assert refused.value.problems[0].field == f"coverage.0.{field}"
    assert words in str(refused.value)


def test_what_clashes_is_refused_with_the_nearest() -> None:
    demand = {"of": {"pose": ["fist"], "environment": ["night"]}, "count": 1}
    with pytest.raises(InvalidInput) as refused:
        spec_of(60, every(3, "pose", "environment"), combinations=[demand])
    assert "combinations.0, coverage.0 cannot be met together" in str(refused.value)
    assert "combinations.0.count: 3 instead of 1" in str(refused.value)


def test_too_many_combinations_are_refused_with_the_images_that_would_do() -> None:
    triple = [every(1, "skin_tone", "pose", "environment")]
    with pytest.raises(InvalidInput, match="29,304 combinations, over 5,000") as refused:
        parse_spec({"count": 60_000, "coverage": triple})
    assert "or for 263,736 images or more, which need no linking" in str(refused.value)
    (found,) = covered(Plan.of(parse_spec({"count": 263_736, "coverage": triple})))
    assert found.smallest >= 1


def test_what_links_too_much_at_once_is_judged_one_by_one_and_planned() -> None:
    asked = [every(2, "pose", "environment"), every(30, "pose", "viewpoint")]
    plan = Plan.of(parse_spec({"count": 9768, "coverage": asked}))
    assert all(one.smallest >= one.at_least for one in covered(plan))


def test_a_plan_that_falls_short_and_cannot_be_mended_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    missed(monkeypatch)
    monkeypatch.setattr(ordering, "linkable", lambda group: False)
    spec = spec_of(77, every(8, "pose", "environment"))
    with pytest.raises(InvalidInput, match="ask for at_least 8, or for more images"):
        Plan.of(spec)


@pytest.mark.parametrize(
    "more",
    [
        {"splits": {"by": "identity", "images": {"train": 50, "test": 10}}},
        {"extends": {"count": 30, "attributes": {"environment": PLACES, "pose": POSES}}},
    ],
)
def test_splits_and_growth_do_not_go_with_it(more: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput, match="coverage"):
        spec_of(60, every(1, "pose", "environment"), **more)
