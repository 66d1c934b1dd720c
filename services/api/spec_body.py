"""A spec in the body of a request: JSON or YAML, in UTF-8, of bounded size."""

import json
from typing import Annotated

from fastapi import Depends, Request
from starlette.requests import ClientDisconnect

from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.spec import DatasetSpec, parse_spec, parse_spec_text
from services.api.contract import SPEC
from services.api.problems import ApiError

JSON_TYPE = "application/json"
YAML_TYPES = frozenset({"application/yaml", "application/x-yaml", "text/yaml"})

OPENAPI_BODY = {
    "requestBody": {
        "required": True,
        "description": "The spec. GET /v1/spec-schema returns its JSON Schema.",
        "content": {
            media_type: {"schema": {"$ref": f"#/components/schemas/{SPEC}"}}
            for media_type in (JSON_TYPE, "application/yaml")
        },
    }
}


def _media_type(request: Request) -> str:
    header = request.headers.get("content-type", "")
    media_type = header.partition(";")[0].strip().lower()
    if media_type != JSON_TYPE and media_type not in YAML_TYPES:
        remedy = "Send the spec as application/json or application/yaml."
        problem = Problem("Content-Type", header, remedy)
        raise ApiError(415, "media-type", "Unknown media type", [problem])
    return media_type


async def _body(request: Request) -> bytes:
    """Read the body; the app's own limit ends one that is too long while it streams in."""
    _media_type(request)
    try:
        return await request.body()
    except ClientDisconnect as error:  # nobody is left to tell, but it is no fault of ours
        problem = Problem("body", "cut off", "Send as many bytes as its length says.")
        raise ApiError(400, "cut-off", "Body cut off", [problem]) from error


def _spec(request: Request, body: Annotated[bytes, Depends(_body)]) -> DatasetSpec:
    """Parse in a worker thread: a megabyte of YAML takes seconds."""
    try:
        text = body.decode("utf-8")
    except UnicodeDecodeError as error:
        remedy = f"Send UTF-8: byte {error.start} is not ({error.reason})."
        raise InvalidInput([Problem("body", body[error.start : error.end], remedy)]) from error
    return _parse_json(text) if _media_type(request) == JSON_TYPE else parse_spec_text(text)


def _parse_json(text: str) -> DatasetSpec:
    try:
        document = json.loads(text, object_pairs_hook=_unique, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        remedy = "Write JSON as RFC 8259 says, each name once; the error is at the place named."
        raise InvalidInput([Problem("body", str(error), remedy)]) from error
    return parse_spec(document)


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    document: dict[str, object] = {}
    for name, value in pairs:
        if name in document:
            raise ValueError(f"name {name!r} is written twice")
        document[name] = value
    return document


def _no_constant(name: str) -> object:
    raise ValueError(f"{name} is not a JSON number")


SpecBody = Annotated[DatasetSpec, Depends(_spec)]
