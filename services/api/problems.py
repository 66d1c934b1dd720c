"""Problem details for HTTP APIs (RFC 9457): the one shape of every error."""

import json
import math
from collections.abc import Mapping, Sequence

from pydantic import BaseModel
from starlette.responses import Response

from hi5_common.domain.errors import Hi5Error, Problem, shown

MEDIA_TYPE = "application/problem+json"
MAX_PROBLEMS = 50
MAX_TEXT = 200

JsonScalar = str | int | float | bool | None


class FieldProblem(BaseModel):
    """One thing wrong: where, what was sent, how to mend it."""

    field: str
    value: JsonScalar
    remedy: str


class ProblemDetails(BaseModel):
    """An error, as sent. `problems` says what to change; it is empty when nothing can be."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    problems: list[FieldProblem]


class ApiError(Hi5Error):
    """A request that cannot be answered as asked."""

    def __init__(
        self,
        status: int,
        slug: str,
        title: str,
        problems: Sequence[Problem] = (),
        detail: str = "",
        headers: Mapping[str, str] | None = None,
    ) -> None:
        self.status = status
        self.slug = slug
        self.title = title
        self.problems = tuple(problems)
        self.detail = detail or "\n".join(_sentence(problem) for problem in problems[:MAX_PROBLEMS])
        self.headers = dict(headers or {})
        super().__init__(self.detail or title)


def problem_response(error: ApiError, instance: str) -> Response:
    """Render an error; sizes are bounded whatever the client sent."""
    details = ProblemDetails(
        type=f"urn:hi5:problem:{error.slug}",
        title=error.title,
        status=error.status,
        detail=error.detail or error.title,
        instance=instance,
        problems=[_field_problem(problem) for problem in error.problems[:MAX_PROBLEMS]],
    )
    # ASCII: a client may send half a surrogate pair, which UTF-8 cannot carry back.
    body = json.dumps(details.model_dump(), ensure_ascii=True, allow_nan=False).encode()
    return Response(body, error.status, error.headers, MEDIA_TYPE)


def _field_problem(problem: Problem) -> FieldProblem:
    return FieldProblem(
        field=_cut(problem.field), value=_shown(problem.value), remedy=problem.remedy
    )


def _sentence(problem: Problem) -> str:
    return f"{_cut(problem.field)}: {shown(problem.value)} is not valid. {problem.remedy}"


def _shown(value: object) -> JsonScalar:
    """Return the value itself if JSON can carry it in a few bytes, else a short description."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, str):
        return _cut(value)
    if isinstance(value, int) and abs(value) < 2**63:
        return int(value)
    if isinstance(value, float) and math.isfinite(value):
        return value
    return shown(value, MAX_TEXT)


def _cut(text: str) -> str:
    return text if len(text) <= MAX_TEXT else text[: MAX_TEXT - 3] + "..."
