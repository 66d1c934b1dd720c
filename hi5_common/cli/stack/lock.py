"""One `hi5 up` a data folder."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hi5_common.domain.errors import InvalidInput, Problem


@contextmanager
def exclusive(data_dir: Path) -> Iterator[None]:
    """Hold the folder for the length of the block. Raises InvalidInput if somebody else has it.

    The kernel drops the lock with the process, however it ends.
    """
    with (data_dir / "up.lock").open("a+") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise _in_use(data_dir, file.name) from None
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        yield


def _in_use(data_dir: Path, lock: str) -> InvalidInput:
    pid = Path(lock).read_text() or "unknown"
    remedy = (
        f"Another `hi5 up` (process {pid}) runs there: use it, stop it with `kill {pid}`, "
        "or name another folder."
    )
    return InvalidInput([Problem("--data-dir", str(data_dir), remedy)])
