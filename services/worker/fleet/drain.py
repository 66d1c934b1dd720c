"""The flag that tells the pool processes of a worker that it is being stopped.

A file, because the pool's processes are spawned and share nothing with the worker's main process
but their environment.
"""

import os
import tempfile
from collections.abc import MutableMapping
from pathlib import Path

VARIABLE = "HI5_DRAIN_FILE"


class DrainFlag:
    """True from the moment the worker is told to stop, or has gone without a word."""

    def __init__(self, path: Path | None, parent_pid: int) -> None:
        self._path = path
        self._parent_pid = parent_pid

    def __call__(self) -> bool:
        """Return whether to take up no new work."""
        orphaned = os.getppid() != self._parent_pid
        return orphaned or (self._path is not None and self._path.exists())


def of_this_process() -> DrainFlag:
    """Return the flag of the worker this pool process belongs to."""
    path = os.environ.get(VARIABLE)
    return DrainFlag(Path(path) if path else None, os.getppid())


def announce(environment: MutableMapping[str, str]) -> Path:
    """Choose the flag's place and name it in the environment of processes yet to start."""
    folder = Path(tempfile.mkdtemp(prefix="hi5-drain-"))
    path = folder / "drain"
    environment[VARIABLE] = str(path)
    return path
