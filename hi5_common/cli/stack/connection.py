"""How commands find the service that `hi5 up` started: one small file in its data folder.

It holds the key of that run too, so that only the user who started it can read it.
"""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path

from hi5_common.settings import Settings

FILE_NAME = "connection.json"


@dataclass(frozen=True)
class Connection:
    """Where the service answers, the process that runs it, and the key that opens it."""

    url: str
    pid: int
    key: str = field(repr=False)


@contextmanager
def announced(data_dir: Path, connection: Connection) -> Iterator[None]:
    """Leave the connection in the data folder for the length of the block."""
    file = data_dir / FILE_NAME
    partial = file.with_suffix(".partial")
    partial.unlink(missing_ok=True)  # whoever made it may have left it open to others
    partial.touch(mode=0o600, exist_ok=False)
    partial.write_text(json.dumps(asdict(connection)) + "\n")
    partial.replace(file)
    try:
        yield
    finally:
        file.unlink(missing_ok=True)


def find(data_dir: Path | None) -> Connection | None:
    """Return the connection of the `hi5 up` that runs in a data folder, if one does."""
    connection = last(data_dir or Settings().data_dir)
    return connection if connection is not None and _alive(connection.pid) else None


def last(data_dir: Path) -> Connection | None:
    """Return the connection that the file names, though the process may have been killed."""
    try:
        found = json.loads((data_dir / FILE_NAME).read_text())
        return Connection(found["url"], found["pid"], found["key"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
