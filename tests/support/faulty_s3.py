"""A proxy on loopback before an S3 store that answers as bad stores do, by a script.

It passes the Host header on unchanged: the signature covers it, and the store checks it.
"""

import contextlib
import http.client
import re
import select
import socket
import struct
import threading
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

from hi5_common.settings import Settings
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.open import open_store
from tests.support.servers import BUCKET, S3Server

_RST_AT_CLOSE = struct.pack("ii", 1, 0)
_CONTENTS = re.compile(rb"<Contents>.*?</Contents>", re.DOTALL)
_KEY = re.compile(rb"<Key>.*?</Key>")
_SLOW_PIECE_BYTES = 4096


class Kind(StrEnum):
    """What a request is for."""

    PUT = "put"
    GET = "get"
    HEAD = "head"
    DELETE = "delete"
    LIST = "list"
    PARTS = "parts"
    """Beginning or completing an upload in parts."""


class Fault(StrEnum):
    """What goes wrong with one request. "Landed" means that it took effect all the same."""

    UNAVAILABLE = "unavailable"
    INTERNAL = "internal"
    LANDED_INTERNAL = "landed_internal"
    LANDED_UNAVAILABLE = "landed_unavailable"
    LANDED_CUT = "landed_cut"
    LANDED_SILENT = "landed_silent"
    CUT_UP = "cut_up"
    """The connection breaks amid the request's body."""
    CUT_DOWN = "cut_down"
    """The connection breaks amid the answer's body, whose length was announced rightly."""
    SILENT = "silent"
    SLOW = "slow"
    FLIPPED = "flipped"
    """One bit of the answer's body is wrong."""
    SHORTENED = "shortened"
    """The answer's body is one byte short, and its length says so."""
    NOT_FOUND = "not_found"
    CONFLICT = "conflict"
    PRECONDITION = "precondition"
    FORBIDDEN = "forbidden"
    SWALLOWED = "swallowed"
    """Answered as if done, and not done."""
    SPOILT = "spoilt"
    """Other bytes of the same length are stored, and the answer says all is well."""
    LAGGING = "lagging"
    """The listing misses the second half of its lines."""
    REPEATING = "repeating"
    """The listing has every line twice."""
    DENIED_INSIDE = "denied_inside"
    """A deletion is answered with 200, and with an error in the answer's body."""


_STATUS = {
    Fault.UNAVAILABLE: (503, "SlowDown"),
    Fault.INTERNAL: (500, "InternalError"),
    Fault.LANDED_INTERNAL: (500, "InternalError"),
    Fault.LANDED_UNAVAILABLE: (503, "SlowDown"),
    Fault.NOT_FOUND: (404, "NoSuchKey"),
    Fault.CONFLICT: (409, "ConditionalRequestConflict"),
    Fault.PRECONDITION: (412, "PreconditionFailed"),
    Fault.FORBIDDEN: (403, "AccessDenied"),
}
_DENIED_INSIDE = (
    b'<?xml version="1.0" encoding="UTF-8"?><DeleteResult><Error>%b'
    b"<Code>InternalError</Code><Message>by the script</Message></Error></DeleteResult>"
)
_LANDED = (
    Fault.LANDED_INTERNAL,
    Fault.LANDED_UNAVAILABLE,
    Fault.LANDED_CUT,
    Fault.LANDED_SILENT,
)


@dataclass(frozen=True)
class Seen:
    """A request that came, and the fault it met."""

    kind: Kind
    key: str
    fault: Fault | None


@dataclass
class FaultyS3:
    """The proxy. A script's faults meet the requests of their kind in turn, then all is well.

    bytes_per_s: how fast slow bodies are, both ways.
    """

    server: S3Server
    bytes_per_s: float = 20_000.0
    scripts: dict[Kind, deque[Fault | None]] = field(default_factory=dict)
    always: dict[Kind, Fault] = field(default_factory=dict)
    seen: list[Seen] = field(default_factory=list)
    ended: threading.Event = field(default_factory=threading.Event)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def script(self, kind: Kind, *faults: Fault | None) -> None:
        """Let the next requests of a kind meet these faults, one each (None: none)."""
        with self._lock:
            self.scripts.setdefault(kind, deque()).extend(faults)

    def heal(self) -> None:
        """Let every request through again."""
        with self._lock:
            self.scripts.clear()
            self.always.clear()

    def settings(self, prefix: str) -> dict[str, object]:
        """Settings that lead to a folder of the bucket, by way of the proxy."""
        return self.server.settings(prefix) | {"s3_endpoint": f"http://127.0.0.1:{self.port}"}

    @property
    def port(self) -> int:
        return int(self._http.server_address[1])

    def start(self) -> None:
        proxy = self

        class Handler(_Handler):
            faulty = proxy

        self._http = _Server(("127.0.0.1", 0), Handler)
        serve = self._http.serve_forever
        threading.Thread(target=serve, args=(0.05,), name="faulty-s3", daemon=True).start()

    def close(self) -> None:
        self.ended.set()
        self._http.shutdown()
        self._http.server_close()

    def fault_of(self, kind: Kind, key: str) -> Fault | None:
        with self._lock:
            waiting = self.scripts.get(kind)
            fault = waiting.popleft() if waiting else self.always.get(kind)
            self.seen.append(Seen(kind, key, fault))
            return fault

    def spoil(self, key: str, body: bytes) -> None:
        """Store other bytes under a key, signed as they should be."""
        other = flipped(body, bit=1)  # not the bit that a reader may find flipped back
        settings = Settings.model_validate(self.server.settings(""))
        open_store(settings).put(key, other, digest(other))


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 64

    def handle_error(self, request: object, client_address: object) -> None:
        """Say nothing: clients that hang up are what this is for."""


@dataclass(frozen=True)
class _Answer:
    status: int
    headers: list[tuple[str, str]]
    body: bytes


class _Handler(BaseHTTPRequestHandler):
    faulty: FaultyS3
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    wbufsize = -1

    def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002 (the base's name)
        """Keep quiet."""

    def _serve(self) -> None:
        parts = urlsplit(self.path)
        query = parse_qs(parts.query, keep_blank_values=True)
        kind = _kind(self.command, query)
        key = parts.path.removeprefix(f"/{BUCKET}").strip("/")
        fault = self.faulty.fault_of(kind, key)
        length = int(self.headers.get("Content-Length") or 0)
        if fault is Fault.CUT_UP:
            self.rfile.read(length // 2)
            return self._cut()
        body = self._read(length, slow=fault is Fault.SLOW)
        if fault is Fault.SILENT:
            return self._wait_for_the_end()
        if fault in _STATUS and fault not in _LANDED:
            return self._fail(fault)
        if fault is Fault.SWALLOWED or (fault is Fault.SPOILT and kind is Kind.PUT):
            if fault is Fault.SPOILT:
                self.faulty.spoil(key, body)
            said = _deleted(body) if kind is Kind.DELETE else b""
            return self._send(_Answer(200, [("ETag", '"0"')], said))
        if fault is Fault.DENIED_INSIDE:
            return self._send(_Answer(200, [], _DENIED_INSIDE % _KEY.findall(body)[0]))
        answer = self._pass_on(body)
        if fault is Fault.LANDED_SILENT:
            return self._wait_for_the_end()
        if fault is Fault.LANDED_CUT:
            return self._cut()
        if fault in _LANDED:
            return self._fail(fault)
        return self._send(_distorted(answer, fault), fault)

    def _read(self, length: int, slow: bool) -> bytes:
        pieces = []
        while length > 0:
            piece = self.rfile.read(min(length, _SLOW_PIECE_BYTES if slow else length))
            if not piece:
                raise ConnectionError("the client hung up")
            pieces.append(piece)
            length -= len(piece)
            if slow:
                self.faulty.ended.wait(len(piece) / self.faulty.bytes_per_s)
        return b"".join(pieces)

    def _pass_on(self, body: bytes) -> _Answer:
        host, port = self.faulty.server.endpoint.removeprefix("http://").split(":")
        upstream = http.client.HTTPConnection(host, int(port), timeout=60)
        try:
            upstream.putrequest(self.command, self.path, skip_host=True, skip_accept_encoding=True)
            for name, value in self.headers.items():
                if name.lower() != "connection":
                    upstream.putheader(name, value)
            upstream.endheaders(body)
            answer = upstream.getresponse()
            return _Answer(answer.status, answer.getheaders(), answer.read())
        finally:
            upstream.close()

    def _fail(self, fault: Fault) -> None:
        status, code = _STATUS[fault]
        text = f"<Error><Code>{code}</Code><Message>by the script</Message></Error>"
        self._send(_Answer(status, [("Content-Type", "application/xml")], text.encode()))

    def _send(self, answer: _Answer, fault: Fault | None = None) -> None:
        body = answer.body
        self.send_response_only(answer.status)
        length = str(len(body))
        for name, value in answer.headers:
            match name.lower():
                case "content-length":
                    if self.command == "HEAD":
                        length = value
                case "transfer-encoding" | "connection":
                    continue
                case _:
                    self.send_header(name, value)
        self.send_header("Content-Length", length)
        self.end_headers()
        if self.command == "HEAD":
            self.wfile.flush()
        elif fault is Fault.CUT_DOWN:
            self.wfile.write(body[: len(body) // 2])
            self.wfile.flush()
            self._cut()
        elif fault is Fault.SLOW:
            self._send_slowly(body)
        else:
            self.wfile.write(body)
            self.wfile.flush()

    def _send_slowly(self, body: bytes) -> None:
        for start in range(0, len(body), _SLOW_PIECE_BYTES):
            piece = body[start : start + _SLOW_PIECE_BYTES]
            self.wfile.write(piece)
            self.wfile.flush()
            self.faulty.ended.wait(len(piece) / self.faulty.bytes_per_s)

    def _cut(self) -> None:
        self.close_connection = True
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RST_AT_CLOSE)
        self.connection.close()

    def _wait_for_the_end(self) -> None:
        """Answer nothing until the client hangs up."""
        self.close_connection = True
        while not self.faulty.ended.is_set():
            if select.select([self.connection], [], [], 0.05)[0]:
                return


for _method in ("GET", "PUT", "HEAD", "POST", "DELETE"):
    setattr(_Handler, f"do_{_method}", _Handler._serve)


def _kind(method: str, query: dict[str, list[str]]) -> Kind:
    match method:
        case "GET" if "list-type" in query:
            return Kind.LIST
        case "POST" if "delete" in query:
            return Kind.DELETE
        case "POST":
            return Kind.PARTS
        case "DELETE" if "uploadId" in query:
            return Kind.PARTS
        case _:
            return Kind(method.lower())


def _distorted(answer: _Answer, fault: Fault | None) -> _Answer:
    match fault:
        case Fault.FLIPPED if answer.body:
            return _Answer(answer.status, answer.headers, flipped(answer.body))
        case Fault.SHORTENED if answer.body:
            return _Answer(answer.status, answer.headers, answer.body[:-1])
        case Fault.LAGGING:
            lines = _CONTENTS.findall(answer.body)
            body = answer.body
            for line in lines[(len(lines) + 1) // 2 :]:
                body = body.replace(line, b"", 1)
            return _Answer(answer.status, answer.headers, body)
        case Fault.REPEATING:
            body = _CONTENTS.sub(lambda line: line[0] * 2, answer.body)
            return _Answer(answer.status, answer.headers, body)
        case _:
            return answer


def _deleted(body: bytes) -> bytes:
    lines = b"".join(b"<Deleted>" + key + b"</Deleted>" for key in _KEY.findall(body))
    return b"<DeleteResult>" + lines + b"</DeleteResult>"


def flipped(body: bytes, bit: int = 0) -> bytes:
    """Return the bytes with one bit of the one in the middle turned over."""
    at = len(body) // 2
    return body[:at] + bytes([body[at] ^ 1 << bit]) + body[at + 1 :] if body else body


@contextlib.contextmanager
def faulty_proxy(server: S3Server) -> Iterator[FaultyS3]:
    """Yield a proxy before a store."""
    proxy = FaultyS3(server)
    proxy.start()
    try:
        yield proxy
    finally:
        proxy.close()
