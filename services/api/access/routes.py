"""Sign in with a key, and out again: for people with a browser."""

from typing import Annotated
from urllib.parse import parse_qs

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import Field

from hi5_common.db.errors import KeyRefused
from hi5_common.domain.errors import Problem
from services.api.access.doors import Gated
from services.api.access.pages import (
    LOGIN,
    SeeOther,
    cookie_name,
    is_local,
    require_own_page,
    session_cookie,
)
from services.api.dashboard.pages import page
from services.api.paging import StrictQuery
from services.api.problems import ApiError

router = APIRouter(include_in_schema=False)

FORM_TYPE = "application/x-www-form-urlencoded"
REASONS = {"": "", "link": "The link was used before, or is too old."}
MOST_FIELDS = 4


class LoginQuery(StrictQuery):
    """Where to go on, and why the page is shown."""

    next: str = Field("/", max_length=2000)
    reason: str = Field("", pattern=r"^(link)?$")


async def _form(request: Request) -> dict[str, str]:
    """Read a form that our own page sent; a field that is there twice counts once."""
    require_own_page(request)
    sent = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if sent != FORM_TYPE:
        problem = Problem("Content-Type", sent, f"Send {FORM_TYPE}.")
        raise ApiError(415, "media-type", "Unknown media type", [problem])
    try:
        fields = parse_qs((await request.body()).decode(), max_num_fields=MOST_FIELDS)
    except ValueError as error:
        problem = Problem("body", "(not shown)", "Send the fields key and next, in UTF-8.")
        raise ApiError(422, "invalid-input", "Not valid as written", [problem]) from error
    return {name: values[0] for name, values in fields.items()}


@router.get(LOGIN)
def show_login(request: Request, query: Annotated[LoginQuery, Query()]) -> Response:
    """Ask for a key."""
    return _login_page(request, query.next, REASONS[query.reason])


@router.post(LOGIN)
def sign_in(
    request: Request, gate: Gated, form: Annotated[dict[str, str], Depends(_form)]
) -> Response:
    """Begin a session of the key's owner."""
    following = form.get("next", "/")
    try:
        token = gate.begin_session(form.get("key", "").strip())
    except KeyRefused as error:
        return _login_page(request, following, str(error), 401)
    cookie = session_cookie(request, request.app.state.api_settings, token)
    return SeeOther(following if is_local(following) else "/", cookie).response()


@router.post("/logout", status_code=204)
def sign_out(request: Request, gate: Gated) -> Response:
    """End the session, and have the browser forget what it kept of it."""
    require_own_page(request)
    gate.end_session(request.cookies.get(cookie_name(request), ""))
    headers = {
        "Set-Cookie": session_cookie(request, request.app.state.api_settings, ""),
        "Clear-Site-Data": '"cache"',
    }
    return Response(status_code=204, headers=headers)


def _login_page(request: Request, following: str, reason: str, status: int = 200) -> Response:
    local = following if is_local(following) else "/"
    shown = page(request, "login.html", following=local, reason=reason)
    shown.status_code = status
    # Under no-referrer, browsers hide where a form comes from; there is no secret in this address.
    shown.headers["Referrer-Policy"] = "same-origin"
    return shown
