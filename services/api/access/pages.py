"""What browsers bring and need: cookies, the page that asks, where to go on."""

from urllib.parse import urlencode

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from hi5_common.domain.errors import Hi5Error, Problem
from services.api.problems import ApiError
from services.api.settings import ApiSettings

LOGIN = "/login"


class SeeOther(Hi5Error):
    """The answer is at another address of this service."""

    def __init__(self, address: str, cookie: str | None = None) -> None:
        self.address, self.cookie = address, cookie
        super().__init__(address)

    def response(self) -> Response:
        """Return the redirection, which sets a cookie if one is given."""
        response = RedirectResponse(self.address, 303, {"Cache-Control": "no-store"})
        if self.cookie is not None:
            response.headers["Set-Cookie"] = self.cookie
        return response


def cookie_name(request: Request) -> str:
    """Return the session cookie's name: browsers keep cookies by host, whatever the port."""
    port = request.headers.get("host", "").rpartition(":")[2]
    return f"hi5_session_{port if port.isdecimal() else 'web'}"


def session_cookie(request: Request, settings: ApiSettings, token: str) -> str:
    """Return the header that gives a session to a browser, or with no token takes it away."""
    response = Response()
    response.set_cookie(
        cookie_name(request),
        token,
        max_age=int(settings.session_s) if token else 0,
        secure=settings.secure_cookies or request.url.scheme == "https",
        httponly=True,
        samesite="strict",
    )
    return response.headers["Set-Cookie"]


def login_address(request: Request, reason: str = "") -> str:
    """Return the page to sign in at, which leads back to the address that was asked for."""
    query = {"next": local_address(request), **({"reason": reason} if reason else {})}
    return f"{LOGIN}?{urlencode(query)}"


def local_address(request: Request) -> str:
    """Return path and query of a request, without a token."""
    rest = [(name, value) for name, value in request.query_params.multi_items() if name != "token"]
    return request.url.path + (f"?{urlencode(rest)}" if rest else "")


def is_local(address: str) -> bool:
    """Tell whether an address that a browser sent leads nowhere but into this service."""
    plain = address.isascii() and address.isprintable() and "\\" not in address
    return plain and address.startswith("/") and not address.startswith("//")


def require_own_page(request: Request) -> None:
    """Refuse a change that a browser asks for from anywhere but our own pages.

    A browser sends Origin or Sec-Fetch-Site with every change; who sends neither shows a key.
    Raises ApiError 403.
    """
    origin = request.headers.get("origin", "null")  # browsers send null where they hide it
    site = request.headers.get("sec-fetch-site")
    host = request.headers.get("host", "")
    by_origin = origin in {f"http://{host}", f"https://{host}"}
    by_site = site == "same-origin" and origin == "null"
    if site in {None, "same-origin"} and (by_origin or by_site):
        return
    remedy = "Use hi5's own pages, or send a key: Authorization: Bearer hi5_…"
    problem = Problem("Origin", origin, remedy)
    raise ApiError(403, "cross-site", "Another site's page asked", [problem])
