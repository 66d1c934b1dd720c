"""How commands find the service that `hi5 up` started: one small file in its data folder."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from hi5_common.settings import Settings

FILE_NAME = "connection.json"


@dataclass(frozen=True)
class Connection:
    """Where the service answers, and the process that runs it."""

    url: str
    pid: int


@contextmanager
def announced(data_dir: Path, connection: Connection) -> Iterator[None]:
    """Leave the connection in the data folder for the length of the block."""
    file = data_dir / FILE_NAME
    partial = file.with_suffix(".partial")
    partial.write_text(json.dumps({"url": connection.url, "pid": connection.pid}) + "\n")
    partial.replace(file)
    try:
        yield
    finally:
        file.unlink(missing_ok=True)


def find(data_dir: Path | None) -> Connection | None:
    """Return the connection of the `hi5 up` that runs in a data folder, if one does."""
    file = (data_dir or Settings().data_dir) / FILE_NAME
    try:
        found = json.loads(file.read_text())
        connection = Connection(found["url"], found["pid"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return connection if _alive(connection.pid) else None


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
