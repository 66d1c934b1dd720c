"""Combinations that a spec demands are met to the image, or refused with what would work."""

import itertools
import random
from collections.abc import Iterator

import pytest

from benchmarks.plan_evenness import furthest_beginning
from hi5_common.domain.balance import balance_of
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Cell, Plan
from hi5_common.domain.planning import order
from hi5_common.domain.records import Tallies
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import Attribute

PLACES = ["city", "forest", "night"]
FEW = {"handedness": ["right"], "viewpoint": ["first_person"], "pose": ["fist", "one"]}


def of(count: int, **values: list[str]) -> dict[str, object]:
    return {"of": values, "count": count}


def spec_of(count: int, *combinations: dict[str, object], **attributes: object) -> DatasetSpec:
    return parse_spec(
        {
            "count": count,
            "attributes": {"environment": PLACES, **FEW, **attributes},
            "combinations": list(combinations),
        }
    )


def met(spec: DatasetSpec, cells: list[Cell]) -> list[int]:
    return [
        sum(
            all(str(getattr(cell, name.value)) in values for name, values in demand.of.items())
            for cell in cells
        )
        for demand in spec.combinations
    ]


def test_a_demanded_combination_gets_its_images_and_the_rest_stays_even() -> None:
    demand = of(12, skin_tone=["dark"], environment=["night"])
    spec = spec_of(120, demand, of(0, gender=["male"], pose=["one"]))
    plan = Plan.of(spec)
    cells = list(plan.cells())
    assert met(spec, cells) == [12, 0]
    assert set(plan.value_counts(Attribute.SKIN_TONE).values()) == {20}
    assert set(plan.value_counts(Attribute.ENVIRONMENT).values()) == {40}
    pairs = plan.pair_counts(Attribute.SKIN_TONE, Attribute.ENVIRONMENT)
    assert {pairs["dark", place] for place in ("city", "forest")} == {4}
    assert all(5 <= pairs[tone, "night"] <= 6 for tone in ("light", "tan", "brown"))
    assert furthest_beginning(plan.order, plan.count) <= 2.0 + 1e-9
    free = [pair for pair in plan.pair_ranges() if set(pair.attributes) == {"gender", "skin_tone"}]
    assert free[0].furthest <= 1.5


def test_demands_hold_where_a_woven_table_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(order, "WOVEN", 2000)
    spec = spec_of(
        9001,
        of(777, skin_tone=["dark"], environment=["night"]),
        of(0, gender=["male"], viewpoint=["first_person"]),
        viewpoint=["first_person", "second_person", "third_person"],
    )
    plan = Plan.of(spec)
    assert len(plan.order.tables) == 2
    assert met(spec, list(plan.cells())) == [777, 0]
    for attribute in (Attribute.SKIN_TONE, Attribute.GENDER, Attribute.VIEWPOINT):
        images = plan.value_counts(attribute).values()
        assert max(images) - min(images) <= 1


def test_the_balance_takes_what_combinations_make_of_pairs_as_requested() -> None:
    plan = Plan.of(spec_of(120, of(12, skin_tone=["dark"], environment=["night"])))
    balance = balance_of(plan.spec, plan.tallies(), Tallies({}, {}), 0)
    assert balance.worst_planned_deviation <= 1.5


@pytest.mark.parametrize(
    ("combinations", "words"),
    [
        ([of(30, skin_tone=["dark"], environment=["night"])], "20 instead of 30"),
        (
            [of(0, skin_tone=["dark"], environment=[place]) for place in PLACES],
            "cannot be met together",
        ),
        ([of(3, skin_tone=["dark"])], "two attributes or more"),
        ([of(3, skin_tone=["drak"], pose=["one"])], "no such value"),
        ([of(3, skin_tone=["dark"], pose=[])], "at least one value"),
        ([of(3, skin_tone=["dark"], age=["30"])], "Every image has 18..90"),
        ([of(3, colour=["dark"], pose=["one"])], "colour"),
    ],
)
def test_what_cannot_be_is_refused(combinations: list[dict[str, object]], words: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        spec_of(120, *combinations)
    assert "combinations" in str(refused.value)
    assert words in str(refused.value)


def test_the_nearest_that_is_named_can_be_met() -> None:
    demands = [
        of(n, skin_tone=["dark"], environment=[p]) for n, p in zip((9, 9, 9), PLACES, strict=True)
    ]
    with pytest.raises(InvalidInput) as refused:
        spec_of(120, *demands)
    (problem,) = refused.value.problems
    for part in problem.remedy.split("met: ")[1].rstrip(".").split("; "):
        field, numbers = part.split(": ")
        demands[int(field.split(".")[1])]["count"] = int(numbers.split(" ")[0])
    spec = spec_of(120, *demands)
    assert met(spec, list(Plan.of(spec).cells())) == [demand["count"] for demand in demands]


def tables(rows: list[int], columns: list[int]) -> Iterator[list[list[int]]]:
    """Yield every table of whole numbers with these sums."""
    if len(rows) == 1:
        yield [columns]
        return
    for first in itertools.product(*(range(min(rows[0], c) + 1) for c in columns)):
        if sum(first) == rows[0]:
            left = [c - f for c, f in zip(columns, first, strict=True)]
            for rest in tables(rows[1:], left):
                yield [list(first), *rest]


@pytest.mark.parametrize("seed", range(25))
def test_what_is_refused_cannot_be_done_and_what_is_not_is_done(seed: int) -> None:
    """Against every table there is, of two attributes with three values and up to 12 images."""
    rng = random.Random(seed)
    count = rng.randint(3, 12)
    tones, places = (sorted(rng.choices(range(count + 1), k=2)) for _ in range(2))
    rows, columns = ([a, b - a, count - b] for a, b in (tones, places))
    names = ["light", "tan", "dark"]
    wanted = []
    for _ in range(rng.randint(1, 3)):
        x, y = rng.sample(names, rng.randint(1, 2)), rng.sample(PLACES, rng.randint(1, 2))
        wanted.append((x, y, rng.randint(0, count // 2)))
    possible = any(
        all(
            sum(table[names.index(x)][PLACES.index(y)] for x in xs for y in ys) == n
            for xs, ys, n in wanted
        )
        for table in tables(rows, columns)
    )
    demands = [of(n, skin_tone=xs, environment=ys) for xs, ys, n in wanted]
    counts = {
        "skin_tone": dict(zip(names, rows, strict=True)),
        "environment": dict(zip(PLACES, columns, strict=True)),
    }
    try:
        spec = spec_of(count, *demands, **counts)
    except InvalidInput:
        assert not possible
        return
    assert possible
    plan = Plan.of(spec)
    assert met(spec, list(plan.cells())) == [n for _, _, n in wanted]
    assert plan.value_counts(Attribute.SKIN_TONE) == counts["skin_tone"]


def test_weights_become_the_nearest_whole_numbers() -> None:
    spec = spec_of(10, skin_tone={"weights": {"light": 1, "tan": 1, "dark": 1.5}})
    assert Plan.of(spec).value_counts(Attribute.SKIN_TONE) == {"light": 3, "tan": 3, "dark": 4}
    assert parse_spec(spec.model_dump(mode="json")) == spec


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        ({"light": -1}, "number from 0"),
        ({"light": 0, "dark": 0}, "above 0"),
        ({"light": "many"}, "number from 0"),
        ({"lihgt": 1}, "lihgt"),
        ({"light": float("nan")}, "number from 0"),
        ({"light": True}, "number from 0"),
    ],
)
def test_weights_that_mean_nothing_are_refused(weights: dict[str, object], words: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        spec_of(10, skin_tone={"weights": weights})
    assert words in str(refused.value)


def test_a_value_of_another_kind_is_refused_and_not_left_out() -> None:
    of = {"gender": [5, "male"], "handedness": ["left"]}
    with pytest.raises(InvalidInput, match=r"^combinations\.0\.of"):
        parse_spec({"count": 20, "combinations": [{"of": of, "count": 3}]})
