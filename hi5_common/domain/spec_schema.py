"""The JSON Schema of a spec, with every attribute's vocabulary spelled out."""

from hi5_common.domain.bands import NUMBER
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.spec_errors import MAX_WEIGHT
from hi5_common.domain.splits import MAX_SPLITS, NAME
from hi5_common.domain.tags import BOTH, PREFIX, TAGS
from hi5_common.domain.twins import TWINNED
from hi5_common.domain.values import OWN_ENVIRONMENT
from hi5_common.domain.vocabulary import (
    DEFAULTS,
    ITA_RANGE_DEG,
    SHAPE_RANGES,
    VALUES,
    Attribute,
)

Schema = dict[str, object]

_ONE_NUMBER = f"^{NUMBER}$"
_NUMBER_OR_BAND = rf"^{NUMBER}(\.\.{NUMBER})?$"
_ANY_TAG = "|".join(TAGS)
_TAGS = rf"^{PREFIX}({_ANY_TAG})(\{BOTH}({_ANY_TAG}))*$"


def spec_json_schema() -> Schema:
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
    schema["$defs"]["Combination"]["properties"]["of"] |= _combined()
    schema["$defs"]["Splits"]["properties"]["images"] |= _split_sizes()
    del schema["$defs"]["Weights"]  # which nothing refers to any more
    twins = {"enum": [attribute.value for attribute in TWINNED], "type": "string"}
    schema["properties"]["twins"] |= {"items": twins, "uniqueItems": True}
    schema["properties"]["labels"]["uniqueItems"] = True
    return schema


def _combined() -> Schema:
    values = {name.value: _list(_value(name)) for name in Attribute}
    return {"properties": values, "additionalProperties": False, "minProperties": 2}


def _split_sizes() -> Schema:
    count = {"type": "integer", "minimum": 1}
    weight = {"type": "number", "exclusiveMinimum": 0}
    return {"anyOf": [_sizes(count), _weighted(_sizes(weight))]}


def _sizes(size: Schema) -> Schema:
    return {
        **_map({"type": "string", "pattern": f"^{NAME.pattern}$"}, size),
        "minProperties": 2,
        "maxProperties": MAX_SPLITS,
    }


def _value(attribute: Attribute) -> Schema:
    return _any([*_words(attribute), *_numbers(attribute)])


def _any(schemas: list[Schema]) -> Schema:
    return {"anyOf": schemas} if len(schemas) > 1 else schemas[0]


def _list(value: Schema) -> Schema:
    return {"type": "array", "items": value, "minItems": 1}


def _map(name: Schema, value: Schema) -> Schema:
    return {
        "type": "object",
        "propertyNames": name,
        "additionalProperties": value,
        "minProperties": 1,
    }


def _request(attribute: Attribute) -> Schema:
    name = _any(_words(attribute))
    count = {"type": "integer", "minimum": 0}
    weight = {"type": "number", "minimum": 0, "maximum": MAX_WEIGHT}
    return {
        "default": None,
        "description": f"{_meaning(attribute)} Left out: {_default(attribute)}.",
        "anyOf": [
            {"type": "null"},
            _list(_value(attribute)) | {"uniqueItems": True},
            _map(name, count),
            _weighted(_map(name, weight)),
        ],
    }


def _weighted(weights: Schema) -> Schema:
    return {
        "type": "object",
        "properties": {"weights": weights},
        "required": ["weights"],
        "additionalProperties": False,
    }


def _words(attribute: Attribute) -> list[Schema]:
    """Return what a value may be as a string."""
    if attribute in SHAPE_RANGES:
        return [{"type": "string", "pattern": _NUMBER_OR_BAND}]
    named: Schema = {"type": "string", "enum": list(VALUES[attribute])}
    if attribute is Attribute.SKIN_TONE:
        return [named, {"type": "string", "pattern": _ONE_NUMBER}]
    if attribute is Attribute.ENVIRONMENT:
        own: dict[str, object] = {"type": "string", "pattern": f"^({OWN_ENVIRONMENT.pattern})$"}
        tags: dict[str, object] = {"type": "string", "pattern": _TAGS}
        return [named, own, tags]
    return [named]


def _numbers(attribute: Attribute) -> list[Schema]:
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
