"""A spec is taken whole or refused with words that name field, value and remedy."""

import json
import re
from pathlib import Path
from typing import Any

import pydantic
import pytest
import yaml

from hi5_common.domain.environments import CATALOGUE
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.spec import (
    DatasetSpec,
    ImageFormat,
    LabelKind,
    Quality,
    load_spec,
    parse_spec,
    parse_spec_text,
)
from hi5_common.domain.spec_errors import MAX_PROBLEMS
from hi5_common.domain.spec_schema import spec_json_schema
from hi5_common.domain.vocabulary import ALWAYS_BALANCED, Attribute

WRONG = [
    ("", "spec", "None", "mapping"),
    ("[1, 2]", "spec", "[1, 2]", "mapping"),
    ("count: [", "spec", "expected", "YAML"),
    ("count: 5\ncount: 6", "spec", "count", "YAML"),
    ("name: x", "count", "None", "required"),
    ("count: 0", "count", "0", "greater than or equal to 1"),
    ("count: -3", "count", "-3", "greater than or equal to 1"),
    ("count: 2000000000", "count", "2000000000", "less than or equal to 1000000000"),
    ("count: 1.5", "count", "1.5", "integer"),
    ("count: true", "count", "True", "integer"),
    ("count: '24'", "count", "'24'", "integer"),
    ("count: 3\ncuont: 4", "cuont", "4", "Did you mean count?"),
    ("count: 3\nseed: -1", "seed", "-1", "greater than or equal to 0"),
    ("count: 3\nname: a/b", "name", "'a/b'", "match pattern"),
    ("count: 3\nimage: {width: 8}", "image.width", "8", "greater than or equal to 16"),
    ("count: 3\nimage: {height: 9000}", "image.height", "9000", "less than or equal to 8192"),
    ("count: 3\nimage: {widht: 64}", "image.widht", "64", "Did you mean width?"),
    ("count: 3\nimage: {format: gif}", "image.format", "'gif'", "'jpeg' or 'png'"),
    ("count: 3\nimage: {jpeg_quality: 101}", "image.jpeg_quality", "101", "equal to 100"),
    ("count: 3\nrender: {quality: best}", "render.quality", "'best'", "'standard'"),
    ("count: 3\nrender: {max_error: 0}", "render.max_error", "0", "equal to 0.003"),
    ("count: 3\nrender: {max_error: .nan}", "render.max_error", "nan", "finite number"),
    (
        "count: 3\nrender: {seconds_per_image: -1}",
        "render.seconds_per_image",
        "-1",
        "equal to 0.05",
    ),
    (
        "count: 3\nrender: {engine: eevee, max_error: 0.01}",
        *("render.max_error", "0.01", "engine: cycles"),
    ),
    (
        "count: 3\nrender: {engine: eevee, quality: reference}",
        *("render.quality", "reference", "draft, standard or high"),
    ),
    ("count: 3\nrender: {engine: lux}", "render.engine", "'lux'", "'eevee'"),
    (
        "count: 3\nrender: {quality: high, max_error: 0.01}",
        *("render", "quality and max_error", "Name one of"),
    ),
    ("count: 3\nlabels: []", "labels", "[]", "at least 1"),
    ("count: 3\nlabels: [box, box]", "labels", "'box'", "once"),
    ("count: 3\nlabels: [boxes]", "labels.0", "'boxes'", "'box'"),
    ("count: 3\nattributes: {gendr: [male]}", "attributes.gendr", "['male']", "mean gender?"),
    ("count: 3\nattributes: {gender: [mael]}", "attributes.gender", "'mael'", "mean male?"),
    ("count: 3\nattributes: {gender: []}", "attributes.gender", "[]", "at least one"),
    ("count: 3\nattributes: {gender: [male, male]}", "attributes.gender", "'male'", "once"),
    ("count: 3\nattributes: {gender: male}", "attributes.gender", "'male'", "list of values"),
    ("count: 3\nattributes: {gender: [1]}", "attributes.gender", "1", "string"),
    ("count: 3\nattributes: {gender: {male: -1}}", "attributes.gender.male", "-1", "0 or more"),
    ("count: 3\nattributes: {gender: {male: 1.5}}", "attributes.gender.male", "1.5", "whole"),
    ("count: 3\nattributes: {gender: {male: 2}}", "attributes.gender", "{'male': 2}", "1 more"),
    ("count: 3\nattributes: {gender: {male: 5}}", "attributes.gender", "{'male': 5}", "2 fewer"),
    ("count: 3\nattributes: {skin_tone: {drak: 3}}", "attributes.skin_tone", "'drak'", "dark"),
    ("count: 3\nattributes: {skin_tone: [41, '41.0']}", "attributes.skin_tone", "'41'", "once"),
    ("count: 3\nattributes: {skin_tone: {41: 1, '41.0': 2}}", "attributes.skin_tone", "41", "once"),
    ("count: 3\nattributes: {skin_tone: [light, 41]}", "attributes.skin_tone", "light", "same"),
    ("count: 3\nattributes: {skin_tone: [70.5]}", "attributes.skin_tone", "70.5", "-90 to 70"),
    ("count: 3\nattributes: {skin_tone: [.nan]}", "attributes.skin_tone", "nan", "-90 to 70"),
    ("count: 3\nattributes: {skin_tone: [-.inf]}", "attributes.skin_tone", "-inf", "-90 to 70"),
    ("count: 3\nattributes: {skin_tone: [true]}", "attributes.skin_tone", "True", "-90 to 70"),
    ("count: 3\nattributes: {skin_tone: ['1..2']}", "attributes.skin_tone", "'1..2'", "-90 to 70"),
    ("count: 3\nattributes: {age: [18-30]}", "attributes.age", "18-30", "Did you mean 18..30?"),
    ("count: 3\nattributes: {age: [30..18]}", "attributes.age", "30..18", "Did you mean 18..30?"),
    ("count: 3\nattributes: {age: [17]}", "attributes.age", "17", "inside 18..90 (years)"),
    ("count: 3\nattributes: {age: [18..91]}", "attributes.age", "18..91", "inside 18..90"),
    ("count: 3\nattributes: {age: 35}", "attributes.age", "35", "list of values"),
    ("count: 3\nattributes: {age: [18..31, 30..60]}", "attributes.age", "18..31 and", "overlap"),
    ("count: 3\nattributes: {age: [18..30, 30]}", "attributes.age", "18..30 and 30", "fixed"),
    ("count: 3\nattributes: {weight: {0..0.5: 2}}", "attributes.weight", "{'0..0.5': 2}", "1 more"),
    ("count: 3\nattributes: {ring: [bnad]}", "attributes.ring", "'bnad'", "Did you mean band?"),
    ("count: 3\nattributes: {environment: [citi]}", "attributes.environment", "citi", "mean city?"),
    (
        "count: 3\nattributes: {environment: ['user:../a']}",
        "attributes.environment",
        "..",
        "user:<",
    ),
    ("count: 1000000\nimages_per_shard: 1", "images_per_shard", "1", "ask for 10"),
]


@pytest.mark.parametrize(("text", "field", "value", "remedy"), WRONG)
def test_a_wrong_spec_names_field_value_and_remedy(
    text: str, field: str, value: str, remedy: str
) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse_spec_text(text)
    (problem,) = caught.value.problems
    assert problem.field == field
    assert value in str(problem.value) or value in repr(problem.value)
    assert remedy in problem.remedy
    assert field in str(problem)


def test_every_problem_is_named_at_once() -> None:
    with pytest.raises(InvalidInput) as caught:
        parse_spec_text("count: 0\nsede: 1\nattributes: {gender: x}")
    assert {problem.field for problem in caught.value.problems} == {
        "count",
        "sede",
        "attributes.gender",
    }


def test_an_error_or_a_time_stands_for_a_quality_and_survives_being_stored() -> None:
    for way, value in (("max_error", 0.02), ("seconds_per_image", 1.5), ("quality", "draft")):
        spec = parse_spec({"count": 1, "render": {way: value}})
        again = parse_spec_text(spec.canonical_json())
        assert again == spec
        told = again.render.model_dump(exclude_none=True, mode="json")
        assert told == {"engine": "cycles", way: value}


def test_defaults_are_the_papers() -> None:
    spec = parse_spec({"count": 1})
    assert (spec.image.width, spec.image.height) == (640, 640)
    assert (spec.image.format, spec.image.jpeg_quality) == (ImageFormat.JPEG, 95)
    assert spec.render.quality is Quality.STANDARD
    assert spec.labels == list(LabelKind)
    assert spec.balanced() == ALWAYS_BALANCED


def test_numbers_and_bands_have_one_spelling_and_an_order() -> None:
    yaml_text = "skin_tone: [-17.50, 55, tan, '41.0']\nage: {60..90: 2, 18..30.0: 3, '45': 1}"
    spec = parse_spec({"count": 6, "attributes": yaml.safe_load(yaml_text)})
    assert spec.attributes.skin_tone == ["-17.5", "55", "tan", "41"]
    assert spec.values_of(Attribute.SKIN_TONE) == ("55", "41", "tan", "-17.5")
    assert spec.attributes.age == {"60..90": 2, "18..30": 3, "45": 1}
    assert spec.values_of(Attribute.AGE) == ("18..30", "45", "60..90")
    assert spec.values_of(Attribute.RING) == ("none",)
    assert spec.balanced() == (*ALWAYS_BALANCED, Attribute.AGE)
    assert parse_spec_text(spec.canonical_json()) == spec


def test_a_users_environments_come_after_the_catalogue_and_never_by_default() -> None:
    asked = ["user:my.room", "night", "polyhaven:abandoned_bakery", "city"]
    spec = parse_spec({"count": 6, "attributes": {"environment": asked}})
    order = ("city", "night", "polyhaven:abandoned_bakery", "user:my.room")
    assert spec.values_of(Attribute.ENVIRONMENT) == order
    everything = parse_spec({"count": 6}).values_of(Attribute.ENVIRONMENT)
    assert everything == tuple(CATALOGUE)


def test_a_long_list_of_nonsense_is_answered_shortly() -> None:
    nonsense = [f"place{number}" for number in range(1000)]
    with pytest.raises(InvalidInput) as caught:
        parse_spec({"count": 6, "attributes": {"environment": nonsense}})
    assert len(caught.value.problems) == MAX_PROBLEMS


def test_yaml_json_and_python_are_one_spec(tmp_path: Path) -> None:
    yaml_text = "count: 6\nattributes:\n  gender: {male: 2, female: 4}\n  pose: [fist]\n"
    document = {
        "count": 6,
        "attributes": {"gender": {"female": 4, "male": 2}, "pose": ["fist"]},
    }
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(document))
    texts = {
        parse_spec_text(yaml_text).canonical_json(),
        load_spec(path).canonical_json(),
        DatasetSpec.model_validate(document).canonical_json(),
    }
    assert len(texts) == 1
    assert parse_spec_text(texts.pop()) == DatasetSpec.model_validate(document)


def test_python_users_get_the_same_words_from_pydantic() -> None:
    with pytest.raises(pydantic.ValidationError, match="add up to 2 but count is 3"):
        DatasetSpec.model_validate({"count": 3, "attributes": {"gender": {"male": 2}}})


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"nowhere\.yaml"):
        load_spec(tmp_path / "nowhere.yaml")


def test_the_schema_spells_out_every_value() -> None:
    schema = json.dumps(spec_json_schema())
    for word in ("very_light", "shakespeares_yorick", "courtyard", "third_person", "left", "gem"):
        assert f'"{word}"' in schema


def schema_of(attribute: str) -> dict[str, Any]:
    found: Any = spec_json_schema()
    request: dict[str, Any] = found["$defs"]["AttributeRequests"]["properties"][attribute]
    return request


@pytest.mark.parametrize(
    ("attribute", "good", "bad"),
    [
        ("skin_tone", ["tan", "-17.5", "41"], ["drak", "1..2", ""]),
        ("age", ["18..30", "35", "-1e-3..+0.5"], ["18-30", "a", ".5..1", "1...2"]),
        (
            "environment",
            ["city", "user:my.room", "polyhaven:a_b", "tag:indoor", "tag:studio+low_light"],
            ["user:../a", "xuser:a", "us", "tag:", "tag:cafe+", "tag:here"],
        ),
        ("ring", ["none", "gem"], ["watch"]),
    ],
)
def test_the_schema_takes_the_strings_that_the_parser_takes(
    attribute: str, good: list[str], bad: list[str]
) -> None:
    words = schema_of(attribute)["anyOf"][2]["propertyNames"]
    choices = words.get("anyOf", [words])

    def fits(text: str) -> bool:
        return any(
            text in choice["enum"] if "enum" in choice else re.search(choice["pattern"], text)
            for choice in choices
        )

    assert [text for text in good if not fits(text)] == []
    assert [text for text in bad if fits(text)] == []


def test_the_schema_bounds_numbers() -> None:
    *_, number = schema_of("skin_tone")["anyOf"][1]["items"]["anyOf"]
    assert number == {"type": "number", "minimum": -90.0, "maximum": 70.0}
    assert "Left out: none." in schema_of("sleeve")["description"]
