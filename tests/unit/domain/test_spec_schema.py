"""The JSON Schema of a spec takes every good spec, and says no to what it can tell is none."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.spec_schema import spec_json_schema
from tests.support.json_schema import takes

SCHEMA = spec_json_schema()
ROOT = Path(__file__).parents[3]
FILES = [*ROOT.glob("examples/*.yaml"), *ROOT.glob("hi5_common/presets/*.yaml")]
TEN = {f"s-_{number}": 2 for number in range(10)}
MANY = [
    {"of": {"gender": ["male"], "skin_tone": [41]}, "count": 5},
    {"of": {"gender": ["female"], "age": ["18..30", 70]}, "count": 12},
]
GOOD: dict[str, dict[str, Any]] = {
    "nothing": {},
    "both twins": {"twins": ["skin_tone", "gender"], "count": 12},
    "counts of splits": {"splits": {"by": "pose", "images": {"a": 8, "weights": 16}}},
    "ten splits": {"splits": {"by": "identity", "images": TEN}, "count": 20},
    "weights of splits": {"splits": {"by": "pose", "images": {"weights": {"a": 0.5, "b": 3}}}},
    "longest name": {"splits": {"by": "identity", "images": {"a" * 32: 4, "b": 20}}},
    "no splits": {"splits": None, "extends": None, "images_per_shard": None},
    "extends": {"extends": {"count": 8, "twins": ["gender"]}, "twins": ["gender"]},
    "combinations": {
        "combinations": MANY,
        "attributes": {"skin_tone": [41, "dark"], "age": ["18..30", 70]},
    },
    "counts": {"attributes": {"gender": {"male": 24, "female": 0}}},
    "weights": {"attributes": {"gender": {"weights": {"male": 0, "female": 0.5}}}},
    "one label": {"labels": ["box"]},
}
SPLIT = {"a": 12, "b": 12}
BAD: dict[str, dict[str, Any]] = {
    "twins of pose": {"twins": ["pose"]},
    "repeated twins": {"twins": ["gender", "gender"]},
    "repeated labels": {"labels": ["box", "box"]},
    "large letters": {"splits": {"by": "identity", "images": {"Train": 12, "b": 12}}},
    "name too long": {"splits": {"by": "identity", "images": {"a" * 33: 12, "b": 12}}},
    "no name": {"splits": {"by": "identity", "images": {"": 12, "b": 12}}},
    "one split": {"splits": {"by": "identity", "images": {"a": 24}}},
    "eleven splits": {"splits": {"by": "identity", "images": {**TEN, "k": 4}}},
    "empty split": {"splits": {"by": "identity", "images": {"a": 24, "b": 0}}},
    "half an image": {"splits": {"by": "identity", "images": {"a": 23.5, "b": 0.5}}},
    "no weight": {"splits": {"by": "identity", "images": {"weights": {"a": 1, "b": 0}}}},
    "weights of one": {"splits": {"by": "identity", "images": {"weights": {"a": 1}}}},
    "weights by a bad name": {"splits": {"by": "pose", "images": {"weights": {"a b": 1, "b": 1}}}},
    "weights and counts": {"splits": {"by": "pose", "images": {"weights": {**SPLIT}, "c": 1}}},
    "one attribute": {"combinations": [{"of": {"gender": ["male"]}, "count": 1}]},
    "no attribute": {"combinations": [{"of": {}, "count": 1}]},
    "no value": {"combinations": [{"of": {"gender": [], "pose": ["fist"]}, "count": 1}]},
    "unknown value": {"combinations": [{"of": {"gender": ["x"], "pose": ["fist"]}, "count": 1}]},
    "empty counts": {"attributes": {"gender": {}}},
    "empty weights": {"attributes": {"gender": {"weights": {}}}},
    "bad extends": {"extends": {"count": 8, "twins": ["pose"]}, "twins": []},
}


@pytest.mark.parametrize("name", GOOD)
def test_a_good_spec_is_taken_as_written_and_as_filled_in(name: str) -> None:
    document = {"count": 24, **GOOD[name]}
    assert takes(SCHEMA, document)
    assert takes(SCHEMA, parse_spec(document).model_dump(mode="json"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_examples_and_presets_are_taken(file: Path) -> None:
    assert takes(SCHEMA, yaml.safe_load(file.read_text(encoding="utf-8")))


@pytest.mark.parametrize("name", BAD)
def test_the_schema_says_no_where_the_parser_does(name: str) -> None:
    document = {"count": 24, **BAD[name]}
    with pytest.raises(InvalidInput):
        parse_spec(document)
    assert not takes(SCHEMA, document)
