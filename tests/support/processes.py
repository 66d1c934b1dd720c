"""hi5's own processes, found by the data folder they were told: no name is guessed."""

import contextlib
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

POLL_S = 0.1


@dataclass(frozen=True)
class Found:
    """A process: its id and its command line."""

    pid: int
    command: str


def of_data_dir(data_dir: Path) -> list[Found]:
    """Return the living processes with this folder in a variable or an argument, but not us."""
    wanted = str(data_dir).encode()
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            command, variables = (
                (folder / "cmdline").read_bytes(),
                (folder / "environ").read_bytes(),
            )
            if wanted in command + variables and int(folder.name) != os.getpid():
                words = command.replace(b"\0", b" ").decode(errors="replace")
                found.append(Found(int(folder.name), words))
    return found


def running(data_dir: Path, part: str) -> list[Found]:
    """Return those with a part in their command line, without the leashes that hold them."""
    return [
        item
        for item in of_data_dir(data_dir)
        if part in item.command and "leash.py" not in item.command
    ]


def wait_until[T](look: Callable[[], T], timeout_s: float, what: str) -> T:
    """Return the first true value of `look`. Raises AssertionError when none comes."""
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        if value := look():
            return value
        time.sleep(POLL_S)
    raise AssertionError(f"not within {timeout_s} s: {what}")
