from itertools import combinations

from hi5_common.domain import tallies
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute

PLAN = Plan.of(parse_spec({"count": 60, "seed": 3}))


def test_values_are_what_the_plan_counts() -> None:
    counted = tallies.tally((cell.as_dict() for cell in PLAN.cells()), PLAN.crossed)
    for attribute in Attribute:
        for value, count in PLAN.value_counts(attribute).items():
            assert counted.values.get(tallies.value_key(attribute, value), 0) == count


def test_every_image_is_in_one_pair_of_any_two_attributes() -> None:
    counted = tallies.tally((cell.as_dict() for cell in PLAN.cells()), PLAN.crossed)
    for a, b in combinations(PLAN.crossed, 2):
        of_both = [
            count
            for key, count in counted.pairs.items()
            if key.startswith(f"{a.value}=") and f"&{b.value}=" in key
        ]
        assert sum(of_both) == PLAN.count


def test_a_plan_knows_what_its_images_add_up_to() -> None:
    for asked in ({}, {"ring": ["none", "gem"]}, {"gender": {"male": 60, "female": 0}}):
        plan = Plan.of(parse_spec({"count": 60, "attributes": asked}))
        cells = (cell.as_dict() for cell in plan.cells())
        assert plan.tallies() == tallies.tally(cells, plan.crossed)


def test_parts_add_up_to_the_whole() -> None:
    cells = [cell.as_dict() for cell in PLAN.cells()]
    cuts = (cells[:17], cells[17:20], cells[20:])
    parts = [tallies.tally(part, PLAN.crossed) for part in cuts]
    assert tallies.add(*parts) == tallies.tally(cells, PLAN.crossed)
    assert tallies.add() == tallies.EMPTY
