"""A TCP proxy on loopback that can misbehave as networks do, told so while it runs."""

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

_PIECE_BYTES = 1 << 16
_RST_AT_CLOSE = struct.pack("ii", 1, 0)


@dataclass
class TcpProxy:
    """Passes connections on to a server. Its attributes may be changed at any time.

    frozen: nothing is passed on and nothing is closed, as when a cable is pulled (half-open).
    answers_frozen: the same for what comes back: requests arrive, and nobody learns of it.
    delay_s: every piece waits so long. bytes_per_s: no faster than this (0: as fast as it goes).
    """

    target: tuple[str, int]
    frozen: bool = False
    answers_frozen: bool = False
    refusing: bool = False
    delay_s: float = 0.0
    bytes_per_s: float = 0.0
    _listener: socket.socket = field(init=False)
    _open: set[socket.socket] = field(init=False, default_factory=set)
    _lock: threading.Lock = field(init=False, default_factory=threading.Lock)
    _ended: threading.Event = field(init=False, default_factory=threading.Event)

    def __post_init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        threading.Thread(target=self._accept, name="proxy", daemon=True).start()

    @property
    def port(self) -> int:
        return int(self._listener.getsockname()[1])

    def heal(self) -> None:
        """Pass on everything again. Connections made while frozen go on."""
        self.frozen = self.answers_frozen = self.refusing = False
        self.delay_s = self.bytes_per_s = 0.0

    def reset(self) -> int:
        """Break every connection with an RST; return how many sockets there were."""
        with self._lock:
            doomed, self._open = self._open, set()
        for each in doomed:
            with contextlib.suppress(OSError):  # ended by itself meanwhile
                each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RST_AT_CLOSE)
                each.shutdown(socket.SHUT_RDWR)
        return len(doomed)

    def close(self) -> None:
        self._ended.set()
        self._listener.close()
        self.reset()

    def _accept(self) -> None:
        while not self._ended.is_set():
            try:
                client, _ = self._listener.accept()
            except OSError:  # closed
                return
            threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        if self.refusing:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RST_AT_CLOSE)
            client.close()
            return
        try:
            server = socket.create_connection(self.target, timeout=5)
        except OSError:
            client.close()
            return
        server.settimeout(None)
        with self._lock:
            self._open |= {client, server}
        back = threading.Thread(target=self._pump, args=(server, client, True), daemon=True)
        back.start()
        self._pump(client, server, False)
        back.join()
        with self._lock:
            self._open -= {client, server}
        for each in (client, server):
            each.close()

    def _pump(self, source: socket.socket, sink: socket.socket, back: bool) -> None:
        with contextlib.suppress(OSError):
            while piece := source.recv(_PIECE_BYTES):
                self._hold(len(piece), back)
                sink.sendall(piece)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_WR)

    def _hold(self, size_bytes: int, back: bool) -> None:
        while (self.frozen or (back and self.answers_frozen)) and not self._ended.is_set():
            time.sleep(0.02)
        pause_s = self.delay_s
        if self.bytes_per_s:
            pause_s += size_bytes / self.bytes_per_s
        if pause_s:
            self._ended.wait(pause_s)


@contextlib.contextmanager
def proxy_to(port: int) -> Iterator[TcpProxy]:
    """Yield a proxy to a server on a loopback port."""
    proxy = TcpProxy(("127.0.0.1", port))
    try:
        yield proxy
    finally:
        proxy.close()
