"""Ports on the loopback interface."""

import socket

from hi5_common.domain.errors import InvalidInput, Problem

LOOPBACK = "127.0.0.1"


def free_port() -> int:
    """Return a port nobody listens on now."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        port: int = probe.getsockname()[1]
        return port


def require_free(port: int) -> int:
    """Return the port, or a free one for 0. Raises InvalidInput if it is taken."""
    if port == 0:
        return free_port()
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((LOOPBACK, port))
        except OSError as error:
            remedy = f"{error.strerror}: choose another, or 0 for any free one."
            raise InvalidInput([Problem("--port", port, remedy)]) from error
    return port
