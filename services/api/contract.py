"""What the OpenAPI document promises beyond what routes' types say: errors, and the spec's schema.

Every status that a route can answer is declared, none by "default", so that a checker of contracts
has something to check.
"""

import functools
import json
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI

from hi5_common.domain.spec_schema import spec_json_schema
from services.api.problems import MEDIA_TYPE, ProblemDetails

type Schema = dict[str, Any]
type Answers = dict[int | str, dict[str, Any]]

SPEC = "SpecRequest"
_SCHEMAS = "#/components/schemas/"


def refused(*statuses: int) -> Answers:
    """Return how a route declares that it may answer with problem details."""
    content = {MEDIA_TYPE: {"schema": {"$ref": f"{_SCHEMAS}ProblemDetails"}}}
    return {
        status: {"description": HTTPStatus(status).phrase, "content": content}
        for status in statuses
    }


def bytes_of(*media_types: str) -> Schema:
    """Return the content of an answer that is a file, of which a schema says nothing."""
    return {"content": {media_type: {} for media_type in media_types}}


EVERYWHERE = refused(400, 401, 403, 413, 422, 429, 500, 503)
"""No host name, no key, another site's page, a body too long, wrong parameters, too often; and
what a part of the service that is away does to every route."""


def declare(app: FastAPI) -> None:
    """Add to the app's OpenAPI document the schemas that `refused` and spec bodies refer to."""
    made = app.openapi

    @functools.cache
    def openapi() -> Schema:
        document = made()
        document["components"]["schemas"] |= _problem_schemas() | _spec_schemas()
        return document

    app.openapi = openapi  # type: ignore[method-assign]  # FastAPI's documented way to extend it


def _problem_schemas() -> Schema:
    schema = ProblemDetails.model_json_schema(ref_template=f"{_SCHEMAS}{{model}}")
    return {**schema.pop("$defs"), "ProblemDetails": schema}


def _spec_schemas() -> Schema:
    """Return the JSON Schema of GET /v1/spec-schema as components, each definition one of them."""
    text = json.dumps(spec_json_schema())
    text = text.replace('"#/$defs/DatasetSpec"', f'"{_SCHEMAS}{SPEC}"')
    schema: Schema = json.loads(text.replace('"#/$defs/', f'"{_SCHEMAS}{SPEC}.'))
    parts = {f"{SPEC}.{name}": part for name, part in schema.pop("$defs").items()}
    del parts[f"{SPEC}.DatasetSpec"]
    return {SPEC: schema, **parts}
