"""The proxy of the fault tests does what it says, or those tests would prove nothing."""

import contextlib
import socket
import threading
from collections.abc import Iterator

import pytest

from tests.support.proxy import TcpProxy, proxy_to


@pytest.fixture
def proxy() -> Iterator[TcpProxy]:
    """A proxy to a server that sends back what it gets."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def echo() -> None:
            while True:
                try:
                    connection, _ = listener.accept()
                except OSError:
                    return
                with connection:
                    while piece := connection.recv(100):
                        connection.sendall(piece)

        threading.Thread(target=echo, daemon=True).start()
        with proxy_to(listener.getsockname()[1]) as made:
            yield made


def connect(proxy: TcpProxy) -> socket.socket:
    return socket.create_connection(("127.0.0.1", proxy.port), timeout=0.3)


def test_it_passes_on(proxy: TcpProxy) -> None:
    with connect(proxy) as client:
        client.sendall(b"hello")
        assert client.recv(100) == b"hello"


def test_frozen_connections_stay_open_and_silent_until_healed(proxy: TcpProxy) -> None:
    with connect(proxy) as client:
        proxy.frozen = True
        client.sendall(b"hello")
        with pytest.raises(TimeoutError):
            client.recv(100)
        proxy.heal()
        client.settimeout(5)
        assert client.recv(100) == b"hello"


def test_reset_breaks_what_is_open(proxy: TcpProxy) -> None:
    with connect(proxy) as client:
        client.sendall(b"hello")
        assert client.recv(100) == b"hello"
        assert proxy.reset() == 2
        client.settimeout(5)
        with contextlib.suppress(ConnectionResetError):
            assert client.recv(100) == b""


def test_refusing_lets_nobody_in(proxy: TcpProxy) -> None:
    proxy.refusing = True
    with contextlib.suppress(ConnectionResetError), connect(proxy) as client:
        client.settimeout(5)
        assert client.recv(100) == b""


def test_a_request_arrives_while_its_answer_does_not() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as listener,
        proxy_to(listener.getsockname()[1]) as proxy,
    ):
        proxy.answers_frozen = True
        with connect(proxy) as client:
            client.sendall(b"hello")
            server, _ = listener.accept()
            with server:
                server.settimeout(5)
                assert server.recv(100) == b"hello"
                server.sendall(b"yes")
                with pytest.raises(TimeoutError):
                    client.recv(100)
                proxy.heal()
                client.settimeout(5)
                assert client.recv(100) == b"yes"
