"""How many shards a worker has at a time, whichever of its processes has them.

A slot is a lock on a file in the folder that the worker's processes share; the kernel takes it
back from a process that dies.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Slots:
    """The slots of one worker. folder None: a process on its own, which always has one."""

    folder: Path | None
    count: int

    @contextmanager
    def one(self) -> Iterator[bool]:
        """Hold a free slot during the block, and give whether there was one."""
        slot = self.take()
        try:
            yield slot is not None
        finally:
            if slot is not None:
                slot.free()

    def take(self) -> "Slot | None":
        """Return a free slot, now held, or None if every one is taken."""
        if self.folder is None:
            return Slot(None)
        self.folder.mkdir(exist_ok=True)  # somebody may have tidied the temporary folder
        for number in range(self.count):
            descriptor = os.open(self.folder / f"slot-{number}", os.O_RDWR | os.O_CREAT, 0o600)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(descriptor)
            else:
                return Slot(descriptor)
        return None


@dataclass(frozen=True)
class Slot:
    """A held slot."""

    descriptor: int | None

    def free(self) -> None:
        """Let another have it."""
        if self.descriptor is not None:
            os.close(self.descriptor)
