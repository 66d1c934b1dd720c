"""HEAD for everything that can be got: the same answer without its body (RFC 9110, 9.3.2)."""

import anyio
from starlette.types import ASGIApp, Message, Receive, Scope, Send

ASKED = "hi5.head"
"""In the scope of a GET that somebody asked the headers of."""


class Head:
    """ASGI middleware that asks the application to GET and sends only the headers."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self.app(scope, receive, send)
            return
        with anyio.CancelScope() as unwanted:

            async def send_headers(message: Message) -> None:
                if message["type"] == "http.response.start":
                    await send(message)
                    await send({"type": "http.response.body", "body": b""})
                unwanted.cancel()  # an object of gigabytes need not be read for this

            await self.app({**scope, "method": "GET", ASKED: True}, receive, send_headers)
