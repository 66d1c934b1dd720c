"""The outermost layer: who may ask, what browsers may do with answers, and no error unanswered."""

import re
from collections.abc import Sequence

from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from hi5_common.domain.errors import Problem
from services.api.errors import internal_error, too_large
from services.api.problems import ApiError, problem_response
from services.api.settings import ANY_HOST

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
        "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}

PRIVATE = "/v1/"
"""Answers below this are the asker's alone, and in no cache unless they say so themselves."""

_HOST = re.compile(r"(?:\[(?P<address>[0-9A-Fa-f:.]+)\]|(?P<name>[A-Za-z0-9._-]+))(?::[0-9]{1,5})?")
"""A header may be no more than this: read as part of a URL it could hide a name behind a path."""


class Shield:
    """ASGI middleware around everything. A process boundary: here no exception passes."""

    def __init__(self, app: ASGIApp, allowed_hosts: Sequence[str], max_body_bytes: int) -> None:
        self.app = app
        self.allowed_hosts = frozenset(host.lower() for host in allowed_hosts)
        self.max_body_bytes = max_body_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started = False

        async def send_shielded(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
                if scope["path"].startswith(PRIVATE):
                    headers.setdefault("Cache-Control", "no-store")
            await send(message)

        request = Request(scope)
        try:
            if refusal := self._refusal(request):
                await problem_response(refusal, scope["path"])(scope, receive, send_shielded)
            else:
                await self.app(scope, receive, send_shielded)
        except Exception as error:
            if started:
                raise  # too late to answer: the server must break the connection
            response = problem_response(internal_error(error), scope["path"])
            await response(scope, receive, send_shielded)

    def _refusal(self, request: Request) -> ApiError | None:
        return (
            self._foreign_host(request) or self._foreign_page(request) or self._long_body(request)
        )

    def _foreign_host(self, request: Request) -> ApiError | None:
        sent = request.headers.get("host", "")
        plain = _HOST.fullmatch(sent)
        if plain is None:
            remedy = "Send a host name or an address, with a port or without, such as localhost."
            return ApiError(400, "host", "No host name", [Problem("Host", sent, remedy)])
        host = (plain["address"] or plain["name"]).lower()
        if ANY_HOST in self.allowed_hosts or host in self.allowed_hosts:
            return None
        remedy = "Add the name to HI5_API_ALLOWED_HOSTS, a JSON list, or use localhost."
        return ApiError(400, "host", "Unknown host name", [Problem("Host", sent, remedy)])

    def _foreign_page(self, request: Request) -> ApiError | None:
        site = request.headers.get("sec-fetch-site", "none")
        if request.method in SAFE_METHODS or site not in {"cross-site", "same-site"}:
            return None
        remedy = "Change datasets from hi5's own pages, the command hi5, or a program."
        problem = Problem("Origin", site, remedy)
        return ApiError(403, "cross-site", "Another site's page asked", [problem])

    def _long_body(self, request: Request) -> ApiError | None:
        # Only what admits to be too long; the app counts the rest while it streams in.
        length = request.headers.get("content-length", "0")
        if not length.isdecimal() or int(length) <= self.max_body_bytes:
            return None
        return too_large(length, self.max_body_bytes)
