"""Requested, planned and delivered, side by side."""

import itertools

import pytest

from hi5_common.domain import tallies
from hi5_common.domain.balance import Balance, balance_of, requested_counts
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import ALWAYS_BALANCED, VALUES, Attribute

MAP = {"gender": {"male": 30, "female": 10}, "handedness": ["left"]}


def plan(count: int = 40, /, **attributes: object) -> Plan:
    return Plan.of(parse_spec({"count": count, "seed": 5, "attributes": attributes}))


def after(made: Plan, images: int) -> Balance:
    """Return the balance when the first `images` images are delivered."""
    counted = tallies.tally((cell.as_dict() for cell in made.cells(0, images)), made.crossed)
    return balance_of(made.spec, made.tallies(), counted, images)


def test_nothing_asked_is_equal_shares_of_every_value() -> None:
    spec = parse_spec({"count": 583_000})
    shares = requested_counts(spec, Attribute.POSE)
    assert list(shares) == list(VALUES[Attribute.POSE])
    assert set(shares.values()) == {13_250.0}


def test_a_list_shares_the_count_and_a_map_is_exact() -> None:
    spec = parse_spec({"count": 40, "attributes": {**MAP, "skin_tone": ["tan", "dark", "light"]}})
    assert requested_counts(spec, Attribute.GENDER) == {"female": 10.0, "male": 30.0}
    assert requested_counts(spec, Attribute.SKIN_TONE) == pytest.approx(
        {"light": 40 / 3, "tan": 40 / 3, "dark": 40 / 3}
    )
    assert list(requested_counts(spec, Attribute.SKIN_TONE)) == ["light", "tan", "dark"]


def test_there_is_a_table_for_each_attribute_and_each_pair() -> None:
    balance = after(plan(), 0)
    assert [table.attributes for table in balance.attributes] == [(a,) for a in Attribute]
    crossed = [table.attributes for table in balance.pairs]
    assert crossed == list(itertools.combinations(ALWAYS_BALANCED, 2))
    assert len(crossed) == 15


@pytest.mark.parametrize("images", [0, 7, 40])
def test_every_table_adds_up(images: int) -> None:
    balance = after(plan(**MAP), images)
    assert (balance.count, balance.delivered) == (40, images)
    for table in balance.attributes + balance.pairs:
        assert sum(cell.requested for cell in table.cells) == pytest.approx(40)
        assert sum(cell.planned for cell in table.cells) == 40
        assert sum(cell.delivered for cell in table.cells) == images


def test_a_complete_dataset_deviates_from_its_plan_nowhere() -> None:
    balance = after(plan(**MAP), 40)
    assert balance.worst_delivered_deviation == 0
    for table in balance.attributes + balance.pairs:
        assert all(cell.delivered == cell.planned for cell in table.cells)


def test_a_pair_is_requested_in_the_product_of_its_shares() -> None:
    balance = after(plan(**MAP), 0)
    table = next(
        t for t in balance.pairs if t.attributes == (Attribute.GENDER, Attribute.SKIN_TONE)
    )
    male_tan = next(cell for cell in table.cells if cell.values == ("male", "tan"))
    assert male_tan.requested == pytest.approx(30 / 6)


def test_deviations_are_the_worst_of_all_cells() -> None:
    made = plan(10, gender={"male": 9, "female": 1})
    woman = {**next(made.cells()).as_dict(), Attribute.GENDER: "female"}
    two_women = tallies.tally([woman] * 2, made.crossed)
    balance = balance_of(made.spec, made.tallies(), two_women, 2)
    gender = balance.attributes[0]
    # Two of ten are delivered: the plan's share is 1.8 men and 0.2 women.
    assert gender.worst_delivered_deviation == pytest.approx(1.8)
    assert gender.worst_planned_deviation == 0
    assert balance.worst_delivered_deviation == pytest.approx(
        max(t.worst_delivered_deviation for t in balance.attributes + balance.pairs)
    )
    assert balance.worst_planned_deviation > 0
