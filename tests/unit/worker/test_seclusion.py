"""A secluded process has no network left, and everything else."""

import socketserver
import subprocess
import sys
import threading
from collections.abc import Iterator

import pytest

from services.worker import seclusion

ASK = """
import os, socket, sys, threading
from services.worker.seclusion import refuse_network
from services.worker.render_child import seclude

def attempt(name):
    try:
        with socket.create_connection(("127.0.0.1", int(sys.argv[1])), timeout=20) as line:
            print(name, line.recv(5).decode())
    except OSError as error:
        print(name, error.strerror)

started, secluded = threading.Event(), threading.Event()
def older():
    started.set()
    secluded.wait()
    attempt("older thread")
thread = threading.Thread(target=older, daemon=True)
thread.start()
started.wait()
"localhost".encode("idna")  # what is imported late is not readable to everybody
if os.getuid() == 0:
    os.setuid(65534)
print("network", seclude(sys.argv[2] == "open"))
attempt("main thread")
secluded.set()
thread.join()
udp = lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
try:
    udp()
    print("udp open")
except PermissionError:
    print("udp refused")
a, b = socket.socketpair()
a.send(b"local")
print(b.recv(5).decode())
sys.stdout.flush()
if pid := os.fork():
    print("its own child", os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
else:
    try:
        udp()
    except PermissionError:
        os._exit(1)
    os._exit(0)
"""


class Greeting(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        self.request.sendall(b"hello")


@pytest.fixture
def port() -> Iterator[int]:
    """Yield the port of a server on loopback that greets whoever the kernel lets in."""
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Greeting) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_address[1]
        server.shutdown()
        thread.join()


def run(port: int, wanted: str) -> list[str]:
    answer = subprocess.run(
        [sys.executable, "-c", ASK, str(port), wanted],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert answer.returncode == 0, answer.stderr
    return answer.stdout.splitlines()


def test_no_thread_and_no_child_of_a_secluded_process_has_a_network(port: int) -> None:
    assert run(port, "none") == [
        "network none",
        "main thread Permission denied",
        "older thread Permission denied",
        "udp refused",
        "local",
        "its own child 1",
    ]


def test_a_process_that_may_reaches_the_same_server(port: int) -> None:
    assert run(port, "open") == [
        "network open: HI5_CHILD_NETWORK allows it",
        "main thread hello",
        "older thread hello",
        "udp open",
        "local",
        "its own child 0",
    ]


def test_a_machine_whose_calls_are_unknown_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    with pytest.raises(seclusion.SeclusionRefused, match="riscv64"):
        seclusion.refuse_network()
