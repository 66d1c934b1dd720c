"""Tags stand for environments of the catalogue, and are read once."""

from collections import Counter

import pytest

from hi5_common.domain.conditions import Combination
from hi5_common.domain.environments import CATALOGUE, EnvironmentKind
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import AttributeRequests, DatasetSpec, parse_spec
from hi5_common.domain.tags import TAGS
from hi5_common.domain.vocabulary import Attribute

ENVIRONMENT = Attribute.ENVIRONMENT


def spec_of(count: int, environment: object, **more: object) -> DatasetSpec:
    return parse_spec({"count": count, "attributes": {"environment": environment}, **more})


def images_of(spec: DatasetSpec, *tags: str) -> int:
    """Count the images a plan has in environments with all of some tags."""
    counts = Plan.of(spec).value_counts(ENVIRONMENT)
    return sum(n for name, n in counts.items() if all(name in TAGS[tag] for tag in tags))


def test_every_environment_has_a_tag_of_place_light_and_making() -> None:
    for tags in (
        ("indoor", "outdoor", "studio"),
        ("low_light", "ordinary_light", "bright_light"),
        ("photographed", "generated"),
    ):
        assert Counter(name for tag in tags for name in TAGS[tag]) == Counter(CATALOGUE.keys())
    assert all(CATALOGUE[name].kind is EnvironmentKind.STUDIO for name in TAGS["studio"])
    assert {CATALOGUE[name].kind for name in TAGS["kitchen"]} == {EnvironmentKind.INDOOR}


def test_a_tag_in_a_list_is_all_its_environments_in_equal_shares() -> None:
    spec = spec_of(120, ["tag:indoor", "night"])
    assert set(spec.values_of(ENVIRONMENT)) == {*TAGS["indoor"], "night"}
    assert spec == spec_of(120, [*TAGS["indoor"], "night"])
    assert "tag:" not in spec.canonical_json()


def test_tags_in_counts_get_exactly_their_images_spread_as_evenly_as_they_go() -> None:
    spec = spec_of(1000, {"tag:indoor": 600, "tag:outdoor": 390, "studio": 10})
    assert images_of(spec, "indoor") == 600
    assert images_of(spec, "outdoor") == 390
    counts = spec.counts_of(ENVIRONMENT) or {}
    assert counts["studio"] == 10
    for tag in ("indoor", "outdoor"):
        each = [counts[name] for name in TAGS[tag]]
        assert max(each) - min(each) == 1


def test_the_seed_says_which_environments_get_one_more() -> None:
    first, again, other = (
        spec_of(50, {"tag:indoor": 50}, seed=seed).counts_of(ENVIRONMENT) for seed in (1, 1, 2)
    )
    assert first == again != other


def test_tags_in_weights_have_their_share_as_a_whole() -> None:
    spec = spec_of(1000, {"weights": {"tag:indoor": 1, "tag:outdoor": 1}})
    assert (images_of(spec, "indoor"), images_of(spec, "outdoor")) == (500, 500)


def test_tags_with_a_plus_between_them_mean_both() -> None:
    spec = spec_of(90, {"tag:outdoor+low_light": 60, "tag:indoor+low_light": 30})
    assert images_of(spec, "outdoor", "low_light") == 60
    assert images_of(spec, "low_light") == 90


def test_a_tag_in_a_combination_is_what_the_dataset_has_of_it() -> None:
    demand = {"of": {"skin_tone": ["dark"], "environment": ["tag:outdoor"]}, "count": 3}
    spec = spec_of(60, ["city", "night", "interior", "studio"], combinations=[demand])
    assert spec.combinations[0].of[ENVIRONMENT] == ["city", "night"]
    pairs = Plan.of(spec).pair_counts(Attribute.SKIN_TONE, ENVIRONMENT)
    assert pairs["dark", "city"] + pairs["dark", "night"] == 3


def test_python_models_may_hold_tags_too() -> None:
    spec = DatasetSpec(
        count=72,
        attributes=AttributeRequests(environment=["tag:indoor"]),
        combinations=[
            Combination(of={Attribute.GENDER: ["male"], ENVIRONMENT: ["tag:cafe"]}, count=0)
        ],
    )
    assert set(spec.values_of(ENVIRONMENT)) == set(TAGS["indoor"])
    assert set(spec.combinations[0].of[ENVIRONMENT]) == set(TAGS["cafe"])


def test_twins_stay_whole_and_growth_keeps_what_was_there() -> None:
    small = spec_of(120, {"tag:indoor": 72, "tag:outdoor": 48}, twins=["gender"])
    assert images_of(small, "indoor") == 72
    large = {"tag:indoor": 144, "tag:outdoor": 50}
    document = {"extends": small.model_dump(mode="json"), "twins": ["gender"]}
    assert images_of(spec_of(194, large, **document), "outdoor") == 50
    with pytest.raises(InvalidInput, match="multiple of that"):
        spec_of(120, {"tag:indoor": 71, "tag:outdoor": 49}, twins=["gender"])


def test_splits_by_environment_take_the_environments_of_tags() -> None:
    splits = {"by": "environment", "images": {"weights": {"train": 4, "test": 1}}}
    spec = spec_of(1000, {"tag:indoor": 600, "tag:outdoor": 400}, splits=splits)
    assert images_of(spec, "indoor") == 600
    assert sum(Plan.of(spec).split_counts().values()) == 1000


@pytest.mark.parametrize(
    ("environment", "field", "words"),
    [
        (["tag:indor"], "attributes.environment", "Did you mean indoor?"),
        (["tag:"], "attributes.environment", "Known tags: indoor, outdoor, studio, low_light"),
        (["tag:indoor+nowhere"], "attributes.environment", "Known tags"),
        (["tag:indoor", "cafe_day"], "attributes.environment", "by tag:indoor and cafe_day"),
        (["tag:indoor", "tag:cafe"], "attributes.environment", "by tag:indoor and tag:cafe"),
        ({"tag:indoor": 9, "cafe_day": 1}, "attributes.environment", "by tag:indoor and cafe_day"),
        (["tag:indoor+outdoor"], "attributes.environment", "leave it out"),
        ({"tag:indoor": "many"}, "attributes.environment.tag:indoor", "whole number"),
        ({"tag:indoor": -1}, "attributes.environment", "whole number"),
        ({"tag:indoor": 11}, "attributes.environment", "add up to 11 but count is 10"),
        ({"weights": {"tag:indoor": -1}}, "attributes.environment", "from 0 to"),
    ],
)
def test_what_cannot_be_read_is_refused(environment: object, field: str, words: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        spec_of(10, environment)
    assert refused.value.problems[0].field.startswith(field)
    assert words in str(refused.value)
