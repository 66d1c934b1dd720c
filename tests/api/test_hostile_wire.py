"""Bodies that no client should send, byte for byte to the real service: all are refused."""

import contextlib
import json
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.support.api_process import ApiProcess, api_process
from tests.support.malformed import GOOD, WIRES, Wire, post

LEAST = 100
MAX_MEMORY_MB = 300.0
PATHS = ("/v1/datasets", "/v1/plans")


@pytest.fixture(scope="module")
def api(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ApiProcess]:
    with api_process(tmp_path_factory.mktemp("wire")) as found:
        yield found


def send(api: ApiProcess, path: str, wire: Wire) -> tuple[int, bytes, bytes]:
    """Return status, header block and body of the answer; status 0 if there is none."""
    headers = "".join(f"{name}: {value}\r\n" for name, value in api.headers().items())
    first = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{headers}"
    with socket.create_connection(("127.0.0.1", api.port), timeout=300) as connection:
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # it has heard enough
            connection.sendall(first.encode() + wire.sent)
            if wire.cut:
                connection.shutdown(socket.SHUT_WR)
        answer = b""
        with contextlib.suppress(ConnectionResetError):
            while piece := connection.recv(65_536):
                answer += piece
    if not answer:
        return 0, b"", b""
    head, _, body = answer.partition(b"\r\n\r\n")
    return int(head.split()[1]), head, body


def test_there_are_a_hundred() -> None:
    assert len(WIRES) >= LEAST


def test_a_good_body_is_taken(api: ApiProcess) -> None:
    """Else a service that refuses everything would pass."""
    assert send(api, PATHS[0], post(GOOD))[0] == 201


@pytest.mark.parametrize("path", PATHS)
def test_every_body_is_refused_and_never_breaks_the_service(api: ApiProcess, path: str) -> None:
    for name, wire in WIRES.items():
        status, head, body = send(api, path, wire)
        if wire.cut and status == 0:
            continue
        assert 400 <= status < 500, (name, status, body[:500])
        if b"problem+json" in head:
            assert len(body) < 65_536
            assert json.loads(body)["problems"], name
        else:  # what the server refuses before the application hears of it
            assert status == 400, (name, head)
            assert b"Invalid HTTP request received." in body, (name, head)


def test_all_at_once_are_refused_too_and_memory_stays_small(api: ApiProcess) -> None:
    heavy = {name: wire for name, wire in WIRES.items() if len(wire.sent) > 50_000}
    with ThreadPoolExecutor(12) as pool:
        statuses = pool.map(lambda wire: send(api, PATHS[1], wire)[0], heavy.values())
        found = dict(zip(heavy, statuses, strict=True))
    assert len(found) > 10
    assert {name: status for name, status in found.items() if not 400 <= status < 500} == {}
    with api.client() as client:
        assert client.get("/healthz").status_code == 200
        assert len(client.get("/v1/datasets").json()["items"]) == 1  # the good one
    assert "Traceback" not in api.log()
    assert api.peak_mb() < MAX_MEMORY_MB
