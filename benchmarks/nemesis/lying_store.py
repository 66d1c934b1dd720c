"""A proxy in front of an S3 store that passes requests on, and can be told to make it lie."""

import http.client
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

_HOP = frozenset({"connection", "keep-alive", "transfer-encoding", "content-length"})
_TIMEOUT_S = 30.0


@dataclass
class LyingStore:
    """An HTTP server on loopback before the store at `target`.

    lies: so many of the uploads to come are answered well, and kept with wrong bytes. late_errors:
    so many requests to come do what they ask for and are answered with 500. Both count down.
    """

    target: tuple[str, int]
    spoil: Callable[[str], None]
    """Changes the bytes of the object at a path of the store."""
    lies: int = 0
    late_errors: int = 0
    told: int = 0
    """Lies and late errors so far."""
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def take_lie(self) -> bool:
        """Return whether the upload at hand is to be kept wrong."""
        with self._lock:
            taken = self.lies > 0
            self.lies -= taken
            self.told += taken
            return taken

    def take_late_error(self) -> bool:
        """Return whether the request at hand is to be answered with 500 although it was done."""
        with self._lock:
            taken = self.late_errors > 0
            self.late_errors -= taken
            self.told += taken
            return taken


@contextmanager
def lying(store: LyingStore) -> Iterator[int]:
    """Serve; yield the port."""

    class Handler(_Passing):
        lying_store = store

    server = _Server(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, name="lying-store", daemon=True)
    thread.start()
    try:
        yield server.server_port
    finally:
        server.shutdown()
        server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 64
    block_on_close = False

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: connections break all the time here."""


class _Passing(BaseHTTPRequestHandler):
    lying_store: LyingStore
    protocol_version = "HTTP/1.1"

    def _pass_on(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        store = self.lying_store
        try:
            status, headers, answer = self._asked(body)
        except OSError:  # the store is away: so are we
            self.close_connection = True
            return
        if self.command == "PUT" and status == 200 and store.take_lie():
            store.spoil(self.path)
        if status < 300 and store.take_late_error():
            status, headers, answer = 500, [], b""
        self._answer(status, headers, answer)

    do_GET = do_HEAD = do_PUT = do_DELETE = do_POST = _pass_on  # noqa: N815  http.server names them

    def _asked(self, body: bytes) -> tuple[int, list[tuple[str, str]], bytes]:
        connection = http.client.HTTPConnection(*self.lying_store.target, timeout=_TIMEOUT_S)
        try:
            connection.putrequest(
                self.command, self.path, skip_host=True, skip_accept_encoding=True
            )
            for name, value in self.headers.items():  # Host too: it is signed
                if name.lower() not in _HOP:
                    connection.putheader(name, value)
            connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            length = answer.getheader("Content-Length")
            headers = [item for item in answer.getheaders() if item[0].lower() not in _HOP]
            content = answer.read()
            if self.command == "HEAD" and length is not None:
                headers.append(("Content-Length", length))
        except http.client.HTTPException as error:
            raise ConnectionError(str(error)) from error
        else:
            return answer.status, headers, content
        finally:
            connection.close()

    def _answer(self, status: int, headers: list[tuple[str, str]], content: bytes) -> None:
        self.send_response_only(status)
        for name, value in headers:
            self.send_header(name, value)
        if self.command != "HEAD":
            self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)
