"""A spec is taken whole or refused with words that name field, value and remedy."""

import json
from pathlib import Path

import pydantic
import pytest

from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.spec import (
    DatasetSpec,
    ImageFormat,
    LabelKind,
    Quality,
    load_spec,
    parse_spec,
    parse_spec_text,
    spec_json_schema,
)

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


def test_defaults_are_the_papers() -> None:
    spec = parse_spec({"count": 1})
    assert (spec.image.width, spec.image.height) == (640, 640)
    assert (spec.image.format, spec.image.jpeg_quality) == (ImageFormat.JPEG, 95)
    assert spec.render.quality is Quality.STANDARD
    assert spec.labels == list(LabelKind)


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
    for word in ("very_light", "shakespeares_yorick", "courtyard", "third_person", "left"):
        assert f'"{word}"' in schema
