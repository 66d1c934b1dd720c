"""The store's proxy passes on what it should, and lies when told."""

from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Thread

import httpx
import pytest

from benchmarks.nemesis.lying_store import LyingStore, lying

KEPT: dict[str, bytes] = {}


class Shelf(BaseHTTPRequestHandler):
    """A store of the simplest kind."""

    def do_GET(self) -> None:
        self.answer(200 if self.path in KEPT else 404, KEPT.get(self.path, b""))

    def do_PUT(self) -> None:
        KEPT[self.path] = self.rfile.read(int(self.headers["Content-Length"]))
        self.answer(200, b"")

    def answer(self, status: int, content: bytes) -> None:
        self.send_response_only(status)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)


@pytest.fixture
def store() -> Iterator[tuple[LyingStore, str]]:
    KEPT.clear()
    server = HTTPServer(("127.0.0.1", 0), Shelf)
    Thread(target=server.serve_forever, daemon=True).start()
    made = LyingStore(
        ("127.0.0.1", server.server_port), lambda path: KEPT.update({path: b"spoilt"})
    )
    with lying(made) as port:
        yield made, f"http://127.0.0.1:{port}"
    server.shutdown()
    server.server_close()


def get(url: str) -> bytes:
    return httpx.get(url).raise_for_status().content


def test_it_passes_on(store: tuple[LyingStore, str]) -> None:
    _, url = store
    assert httpx.put(f"{url}/a", content=b"abc").status_code == 200
    assert get(f"{url}/a") == b"abc"
    assert httpx.get(f"{url}/b").status_code == 404


def test_it_keeps_wrong_bytes_as_often_as_told(store: tuple[LyingStore, str]) -> None:
    made, url = store
    made.lies = 1
    for name in "ab":
        assert httpx.put(f"{url}/{name}", content=b"abc").status_code == 200
    assert (get(f"{url}/a"), get(f"{url}/b")) == (b"spoilt", b"abc")
    assert (made.lies, made.told) == (0, 1)


def test_it_does_as_asked_and_answers_500(store: tuple[LyingStore, str]) -> None:
    made, url = store
    made.late_errors = 1
    assert httpx.put(f"{url}/a", content=b"abc").status_code == 500
    assert get(f"{url}/a") == b"abc"
