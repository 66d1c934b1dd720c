"""What the processes of one worker share: a folder, named in their environment.

In it are the flag that says the worker is being stopped, the slots, and when a doorbell last rang.
Files, because the processes are spawned and share nothing but their environment.
"""

import os
import tempfile
import time
from collections.abc import MutableMapping
from dataclasses import dataclass
from pathlib import Path

VARIABLE = "HI5_DRAIN_FILE"


class DrainFlag:
    """True from the moment the worker is told to stop, or has gone without a word."""

    def __init__(self, path: Path | None, parent_pid: int) -> None:
        self._path = path
        self._parent_pid = parent_pid

    def __call__(self) -> bool:
        """Return whether to take up no new work."""
        return self.orphaned() or (self._path is not None and self._path.exists())

    def orphaned(self) -> bool:
        """Return whether the worker's main process is gone."""
        return os.getppid() != self._parent_pid


@dataclass(frozen=True)
class Bell:
    """When a doorbell last rang in this worker, whichever of its processes heard it."""

    path: Path | None

    def note(self) -> None:
        """Say that it rings now."""
        if self.path is not None:
            self.path.parent.mkdir(exist_ok=True)
            self.path.touch()

    def age_s(self) -> float | None:
        """Return the seconds since it rang; None if it never did."""
        try:
            rung_s = None if self.path is None else self.path.stat().st_mtime
        except FileNotFoundError:
            return None
        return None if rung_s is None else max(0.0, time.time() - rung_s)


def folder_of_this_process() -> Path | None:
    """Return the folder of the worker that this process belongs to."""
    path = os.environ.get(VARIABLE)
    return Path(path).parent if path else None


def of_this_process() -> DrainFlag:
    """Return the flag of the worker that this process belongs to."""
    path = os.environ.get(VARIABLE)
    return DrainFlag(Path(path) if path else None, os.getppid())


def bell_of_this_process() -> Bell:
    """Return the bell of the worker that this process belongs to."""
    folder = folder_of_this_process()
    return Bell(folder and folder / "rung")


def announce(environment: MutableMapping[str, str]) -> Path:
    """Choose the flag's place and name it in the environment of processes yet to start."""
    folder = Path(tempfile.mkdtemp(prefix="hi5-drain-"))
    path = folder / "drain"
    environment[VARIABLE] = str(path)
    return path
