"""From any exception to the problem that is sent: one table, one handler."""

import logging
from collections.abc import Sequence
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Match

from hi5_common.db import errors as db_errors
from hi5_common.domain.errors import Hi5Error, InvalidInput, Problem, TransientError
from hi5_common.storage.errors import ObjectMissing, WrongBytes
from services.api.problems import ApiError, problem_response

log = logging.getLogger(__name__)

RETRY_AFTER_S = 5
METHODS = ("DELETE", "GET", "HEAD", "PATCH", "POST", "PUT")


def install(app: FastAPI) -> None:
    """Render hi5's, the framework's and the validator's errors alike."""
    for kind in (Hi5Error, HTTPException, RequestValidationError):
        app.add_exception_handler(kind, handle)


def handle(request: Request, error: Exception) -> Response:
    """Render one error as problem details."""
    return problem_response(as_api_error(request, error), request.url.path)


def as_api_error(request: Request, error: Exception) -> ApiError:
    """Translate; what nobody foresaw becomes a 500 that says nothing of our insides."""
    match error:
        case ApiError():
            return error
        case RequestValidationError():
            return _invalid([_translated(detail) for detail in error.errors()])
        case HTTPException():
            return _http_error(request, error)
        case Hi5Error():
            return _domain_error(error)
        case _:
            return internal_error(error)


def internal_error(error: Exception) -> ApiError:
    """Log the whole story and tell the client only that it is our fault."""
    log.error("request failed", exc_info=error, extra={"action": "request"})
    detail = "hi5 failed to answer. The log of the API says why."
    return ApiError(500, "internal", "Internal error", detail=detail)


def too_large(length: str, limit: int) -> ApiError:
    """Say how long a body may be; `length` is what is known of this one's."""
    problem = Problem("body", f"{length} bytes", f"Send at most {limit} bytes.")
    return ApiError(413, "too-large", "Body too large", [problem])


def _not_found(error: db_errors.DatasetNotFound | db_errors.WorkerNotFound) -> ApiError:
    if isinstance(error, db_errors.WorkerNotFound):
        problem = Problem("name", error.name, "GET /v1/workers lists the workers there are.")
        return ApiError(404, "not-found", "No such worker", [problem])
    remedy = "GET /v1/datasets lists the datasets there are."
    problem = Problem("dataset_id", str(error.dataset_id), remedy)
    return ApiError(404, "not-found", "No such dataset", [problem])


def _domain_error(error: Hi5Error) -> ApiError:
    match error:
        case db_errors.IdempotencyConflict():
            return ApiError(409, "conflict", "Idempotency key in use", error.problems)
        case db_errors.ImageNotFound():
            return ApiError(404, "not-found", "No such image", error.problems)
        case InvalidInput():
            return _invalid(error.problems)
        case db_errors.DatasetInUse():
            remedy = "Another dataset extends it and has its images: delete that one first."
            problem = Problem("dataset_id", str(error.dataset_id), remedy)
            return ApiError(409, "conflict", "Dataset in use", [problem])
        case db_errors.DatasetNotFound() | db_errors.WorkerNotFound():
            return _not_found(error)
        case WrongBytes():
            log.error("published object damaged", exc_info=error, extra={"action": "request"})
            detail = "A published file is not what was stored. `hi5 audit` names all."
            return ApiError(502, "object-damaged", "Published file damaged", detail=detail)
        case TransientError():
            log.warning("not available", exc_info=error, extra={"action": "request"})
            headers = {"Retry-After": str(RETRY_AFTER_S)}
            detail = "A part that hi5 needs does not answer. Try again; /readyz says which part."
            return ApiError(503, "unavailable", "Not available now", (), detail, headers)
        case db_errors.DatabaseOutdated():
            log.error("database outdated", exc_info=error, extra={"action": "request"})
            return ApiError(503, "outdated", "The database is not set up", detail=str(error))
        case ObjectMissing():
            log.error("published object lost", exc_info=error, extra={"action": "request"})
            detail = "A published file is no longer in the object store. `hi5 audit` names all."
            return ApiError(404, "object-lost", "Published file lost", detail=detail)
        case _:
            return internal_error(error)


def _invalid(problems: Sequence[Problem]) -> ApiError:
    return ApiError(422, "invalid-input", "Not valid as written", problems)


def _translated(detail: dict[str, Any]) -> Problem:
    place, *names = [str(part) for part in detail["loc"]]
    field = ".".join(names) or place
    if detail["type"] == "extra_forbidden":
        return Problem(field, detail["input"], f"There is no such {place} parameter. Leave it out.")
    return Problem(field, detail.get("input"), f"{detail['msg']}.")


def _methods(request: Request) -> list[str]:
    """Return what a path can be asked; the framework names only the first route's methods."""

    def taken(method: str) -> bool:
        scope = {**request.scope, "method": "GET" if method == "HEAD" else method}
        return any(route.matches(scope)[0] is Match.FULL for route in request.app.routes)

    return [method for method in METHODS if taken(method)]


def _http_error(request: Request, error: HTTPException) -> ApiError:
    headers = dict(error.headers or {})
    path = request.url.path
    match error.status_code:
        case 404:
            problem = Problem("path", path, "There is no such route. /openapi.json lists them.")
            return ApiError(404, "no-route", "No such route", [problem])
        case 405:
            headers["Allow"] = ", ".join(_methods(request))
            remedy = f"{path} takes {headers['Allow']}."
            problem = Problem("method", request.method, remedy)
            return ApiError(405, "no-method", "No such method here", [problem], headers=headers)
        case 413:
            limit = request.app.state.max_body_bytes
            return too_large(f"more than {limit}", limit)
        case status:
            problem = Problem("request", request.method, f"{error.detail}.")
            return ApiError(status, "request", "Bad request", [problem], headers=headers)
