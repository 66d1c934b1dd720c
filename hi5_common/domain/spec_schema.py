"""The JSON Schema of a spec, with every attribute's vocabulary spelled out."""

from collections.abc import Mapping

from hi5_common.domain.bands import NUMBER
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.spec_errors import MAX_WEIGHT
from hi5_common.domain.tags import BOTH, PREFIX, TAGS
from hi5_common.domain.values import OWN_ENVIRONMENT
from hi5_common.domain.vocabulary import (
    DEFAULTS,
    ITA_RANGE_DEG,
    SHAPE_RANGES,
    VALUES,
    Attribute,
)

_ONE_NUMBER = f"^{NUMBER}$"
_NUMBER_OR_BAND = rf"^{NUMBER}(\.\.{NUMBER})?$"
_ANY_TAG = "|".join(TAGS)
_TAGS = rf"^{PREFIX}({_ANY_TAG})(\{BOTH}({_ANY_TAG}))*$"


def spec_json_schema() -> dict[str, object]:
    """Return the JSON Schema of a spec.

    It cannot say everything: counts that add up, bands that do not overlap and the ends of bands
    are for `parse_spec`.
    """
    schema = DatasetSpec.model_json_schema()
    # A spec may hold another, so pydantic names it: its fields are shown at the top all the same.
    del schema["$ref"]
    schema |= schema["$defs"]["DatasetSpec"]
    properties = schema["$defs"]["AttributeRequests"]["properties"]
    for attribute in Attribute:
        properties[attribute.value] = _request(attribute)
    return schema


def _request(attribute: Attribute) -> dict[str, object]:
    words, numbers = _words(attribute), _numbers(attribute)
    value = {"anyOf": [*words, *numbers]} if len(words) + len(numbers) > 1 else words[0]
    name = {"anyOf": words} if len(words) > 1 else words[0]
    count = {"type": "integer", "minimum": 0}
    return {
        "default": None,
        "description": f"{_meaning(attribute)} Left out: {_default(attribute)}.",
        "anyOf": [
            {"type": "null"},
            {"type": "array", "items": value, "minItems": 1, "uniqueItems": True},
            {"type": "object", "propertyNames": name, "additionalProperties": count},
            _weights(name),
        ],
    }


def _weights(name: Mapping[str, object]) -> dict[str, object]:
    weight = {"type": "number", "minimum": 0, "maximum": MAX_WEIGHT}
    weights = {"type": "object", "propertyNames": name, "additionalProperties": weight}
    return {
        "type": "object",
        "properties": {"weights": weights},
        "required": ["weights"],
        "additionalProperties": False,
    }


def _words(attribute: Attribute) -> list[dict[str, object]]:
    """Return what a value may be as a string."""
    if attribute in SHAPE_RANGES:
        return [{"type": "string", "pattern": _NUMBER_OR_BAND}]
    named: dict[str, object] = {"type": "string", "enum": list(VALUES[attribute])}
    if attribute is Attribute.SKIN_TONE:
        return [named, {"type": "string", "pattern": _ONE_NUMBER}]
    if attribute is Attribute.ENVIRONMENT:
        own: dict[str, object] = {"type": "string", "pattern": f"^({OWN_ENVIRONMENT.pattern})$"}
        tags: dict[str, object] = {"type": "string", "pattern": _TAGS}
        return [named, own, tags]
    return [named]


def _numbers(attribute: Attribute) -> list[dict[str, object]]:
    """Return what a value may be as a number."""
    if attribute is Attribute.SKIN_TONE:
        low, high = ITA_RANGE_DEG
    elif attribute in SHAPE_RANGES:
        low, high = SHAPE_RANGES[attribute].low, SHAPE_RANGES[attribute].high
    else:
        return []
    return [{"type": "number", "minimum": low, "maximum": high}]


def _meaning(attribute: Attribute) -> str:
    if attribute is Attribute.SKIN_TONE:
        return "Names, or typology angles in degrees."
    if attribute is Attribute.ENVIRONMENT:
        return "Ids of the catalogue, tags of many (tag:indoor), polyhaven:<id> or user:<name>."
    if attribute in SHAPE_RANGES:
        return f"Numbers or bands low..high: {SHAPE_RANGES[attribute].unit}."
    return "Names."


def _default(attribute: Attribute) -> str:
    found = DEFAULTS[attribute]
    return found[0] if len(found) == 1 else f"all {len(found)} in equal shares"
