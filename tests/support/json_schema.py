"""What a JSON Schema takes, as far as the schema of a spec goes: other keywords are an error."""

import re
from collections.abc import Callable, Mapping
from typing import Any

Schema = Mapping[str, Any]
_WORDS_ONLY = frozenset({"title", "description", "default", "$defs"})


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


_TYPES: dict[str, Callable[[Any], bool]] = {
    "null": lambda value: value is None,
    "boolean": lambda value: isinstance(value, bool),
    "string": lambda value: isinstance(value, str),
    "array": lambda value: isinstance(value, list),
    "object": lambda value: isinstance(value, dict),
    "number": _is_number,
    "integer": lambda value: _is_number(value) and float(value).is_integer(),
}


def takes(schema: Schema, document: object) -> bool:
    """Tell whether a document is valid. Raises KeyError at a keyword that is not known here."""
    return _fits(schema, document, schema)


def _fits(schema: Schema, value: Any, root: Schema) -> bool:
    return all(
        _KEYWORDS[keyword](asked, value, schema, root)
        for keyword, asked in schema.items()
        if keyword not in _WORDS_ONLY
    )


def _of(kind: str, holds: Callable[[Any, Any], bool]) -> Callable[[Any, Any, Schema, Schema], bool]:
    """Return a keyword that says nothing of values of other types."""
    return lambda asked, value, _schema, _root: not _TYPES[kind](value) or holds(asked, value)


def _refers(asked: str, value: Any, _schema: Schema, root: Schema) -> bool:
    return _fits(root["$defs"][asked.removeprefix("#/$defs/")], value, root)


def _any_of(asked: list[Schema], value: Any, _schema: Schema, root: Schema) -> bool:
    return any(_fits(one, value, root) for one in asked)


def _items(asked: Schema, value: Any, _schema: Schema, root: Schema) -> bool:
    return not isinstance(value, list) or all(_fits(asked, item, root) for item in value)


def _properties(asked: Mapping[str, Schema], value: Any, _schema: Schema, root: Schema) -> bool:
    return not isinstance(value, dict) or all(
        _fits(asked[name], item, root) for name, item in value.items() if name in asked
    )


def _names(asked: Schema, value: Any, _schema: Schema, root: Schema) -> bool:
    return not isinstance(value, dict) or all(_fits(asked, name, root) for name in value)


def _others(asked: Schema | bool, value: Any, schema: Schema, root: Schema) -> bool:
    others = [
        item
        for name, item in (value.items() if isinstance(value, dict) else ())
        if name not in schema.get("properties", {})
    ]
    if isinstance(asked, bool):
        return asked or not others
    return all(_fits(asked, item, root) for item in others)


_KEYWORDS: Mapping[str, Callable[[Any, Any, Schema, Schema], bool]] = {
    "$ref": _refers,
    "additionalProperties": _others,
    "anyOf": _any_of,
    "const": lambda asked, value, _schema, _root: asked == value,
    "enum": lambda asked, value, _schema, _root: value in asked,
    "exclusiveMaximum": _of("number", lambda most, value: value < most),
    "exclusiveMinimum": _of("number", lambda least, value: value > least),
    "items": _items,
    "maxItems": _of("array", lambda most, value: len(value) <= most),
    "maxLength": _of("string", lambda most, value: len(value) <= most),
    "maxProperties": _of("object", lambda most, value: len(value) <= most),
    "maximum": _of("number", lambda most, value: value <= most),
    "minItems": _of("array", lambda least, value: len(value) >= least),
    "minLength": _of("string", lambda least, value: len(value) >= least),
    "minProperties": _of("object", lambda least, value: len(value) >= least),
    "minimum": _of("number", lambda least, value: value >= least),
    "pattern": _of("string", lambda pattern, value: re.search(pattern, value) is not None),
    "properties": _properties,
    "propertyNames": _names,
    "required": _of("object", lambda names, value: set(names) <= value.keys()),
    "type": lambda asked, value, _schema, _root: _TYPES[asked](value),
    "uniqueItems": _of("array", lambda _asked, value: len(set(map(repr, value))) == len(value)),
}
