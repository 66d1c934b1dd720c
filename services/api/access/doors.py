"""The ways into the service. Each route takes one, and by that says which scope it needs.

`Reading`, `Writing` and `Administering` are for programs and for our own pages, `Visiting` is for
people: who is not signed in is led to where they can be. A route without a door is refused when the
app is put together, unless it is in OPEN.
"""

import base64
from collections.abc import Callable, Iterable
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Security
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from hi5_common.db.errors import KeyRefused
from hi5_common.domain.access import Caller, Scope
from hi5_common.domain.errors import Problem
from services.api.access.access import Access
from services.api.access.gate import Gate
from services.api.access.pages import (
    SeeOther,
    cookie_name,
    local_address,
    login_address,
    require_own_page,
    session_cookie,
)
from services.api.parts import Wired
from services.api.problems import ApiError
from services.api.shield import SAFE_METHODS

OPEN = {
    "/healthz": "says that the process lives",
    "/readyz": "says which part does not answer, for who restarts it",
    "/login": "asks for a key",
    "/logout": "ends the session whose cookie is sent",
}
"""Routes for everybody, and why. /static and /openapi.json are the same in every hi5."""

_bearer = HTTPBearer(
    scheme_name="key",
    bearerFormat="hi5_<id>_<secret>_<checksum>",
    description="A key that `hi5 keys create` made.",
    auto_error=False,
)
Bearer = Annotated[HTTPAuthorizationCredentials | None, Security(_bearer)]


def gate_of(request: Request) -> Gate:
    """Return the gate of the app that answers."""
    gate: Gate = request.app.state.gate
    return gate


Gated = Annotated[Gate, Depends(gate_of)]


def reading(request: Request, parts: Wired, gate: Gated, bearer: Bearer) -> Access:
    """Let in who may read."""
    return Access(parts, _admitted(request, gate, bearer, Scope.READ))


def writing(request: Request, parts: Wired, gate: Gated, bearer: Bearer) -> Access:
    """Let in who may change."""
    return Access(parts, _admitted(request, gate, bearer, Scope.WRITE))


def administering(request: Request, parts: Wired, gate: Gated, bearer: Bearer) -> Access:
    """Let in who looks after the service and sees everybody's."""
    return Access(parts, _admitted(request, gate, bearer, Scope.ADMIN))


def visiting(request: Request, parts: Wired, gate: Gated, bearer: Bearer) -> Access:
    """Let a person look, or lead them to where they sign in; a one-time link signs them in."""
    if token := request.query_params.get("token"):
        raise _signed_in(request, gate, token)
    shows_key = "authorization" in request.headers
    try:
        return Access(parts, _admitted(request, gate, bearer, Scope.READ))
    except ApiError as error:
        if error.status != 401 or shows_key:
            raise
        raise SeeOther(login_address(request)) from error


Reading = Annotated[Access, Depends(reading)]
Writing = Annotated[Access, Depends(writing)]
Administering = Annotated[Access, Depends(administering)]
Visiting = Annotated[Access, Depends(visiting)]

SCOPES: dict[Callable[..., object], Scope] = {
    reading: Scope.READ,
    writing: Scope.WRITE,
    administering: Scope.ADMIN,
    visiting: Scope.READ,
}


def require_doors(routers: Iterable[APIRouter]) -> None:
    """Refuse to serve a route that nobody guards. Raises RuntimeError."""
    for router in routers:
        for route in router.routes:
            guarded = isinstance(route, APIRoute) and scope_of(route) is not None
            if not guarded and getattr(route, "path", None) not in OPEN:
                raise RuntimeError(
                    f"{route} has no door: take Reading, Writing, Administering or Visiting"
                )


def scope_of(route: APIRoute) -> Scope | None:
    """Return the scope that a route declares by its door; None without one."""
    found = [SCOPES[call] for call in _calls(route.dependant) if call in SCOPES]
    return max(found, key=list(Scope).index) if found else None


def _calls(dependant: Dependant) -> Iterable[Callable[..., object]]:
    for each in dependant.dependencies:
        if each.call is not None:
            yield each.call
        yield from _calls(each)


def _admitted(
    request: Request, gate: Gate, bearer: HTTPAuthorizationCredentials | None, scope: Scope
) -> Caller:
    caller = _caller(request, gate, bearer)
    gate.count(caller)
    request.state.caller = caller
    if not caller.scope.includes(scope):
        remedy = f"Use a key of scope {scope}: `hi5 keys create --scope {scope}`."
        problem = Problem("scope", caller.scope.value, remedy)
        raise ApiError(403, "scope", "The key does not allow this", [problem])
    return caller


def _caller(request: Request, gate: Gate, bearer: HTTPAuthorizationCredentials | None) -> Caller:
    cookie = request.cookies.get(cookie_name(request))
    try:
        if bearer is not None:
            return gate.by_key(bearer.credentials)
        if "authorization" in request.headers:
            return gate.by_key(_basic_password(request))
        if cookie is None:
            raise KeyRefused("No key was sent.")
        caller = gate.by_session(cookie)
    except KeyRefused as error:
        raise _unknown(str(error)) from error
    if request.method not in SAFE_METHODS:
        require_own_page(request)
    return caller


def _basic_password(request: Request) -> str:
    """Return the password of Basic credentials: many programs can send no other. To read only, as
    browsers keep such credentials and send them with what any page asks for.
    """
    scheme, _, encoded = request.headers["authorization"].partition(" ")
    if scheme.lower() != "basic" or request.method not in SAFE_METHODS:
        raise KeyRefused("The header is not: Bearer, a space, and a key.")
    try:
        return base64.b64decode(encoded, validate=True).decode().partition(":")[2]
    except ValueError as error:
        raise KeyRefused("The header is not Basic, a space, and base64 of name:key.") from error


def _unknown(reason: str) -> ApiError:
    remedy = f"{reason} Send Authorization: Bearer and a key that `hi5 keys create` made."
    problem = Problem("Authorization", "(not shown)", remedy)
    headers = {"WWW-Authenticate": 'Bearer realm="hi5"'}
    return ApiError(401, "key", "Who are you?", [problem], detail=remedy, headers=headers)


def _signed_in(request: Request, gate: Gate, token: str) -> SeeOther:
    try:
        session = gate.begin_session_by_link(token)
    except KeyRefused:
        if _has_session(request, gate):
            return SeeOther(local_address(request))
        return SeeOther(login_address(request, "link"))
    settings = request.app.state.api_settings
    return SeeOther(local_address(request), session_cookie(request, settings, session))


def _has_session(request: Request, gate: Gate) -> bool:
    try:
        gate.by_session(request.cookies.get(cookie_name(request), ""))
    except KeyRefused:
        return False
    return True
