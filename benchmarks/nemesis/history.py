"""The history: one JSON object a line, appended by whoever does or sees something."""

import json
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Entry:
    """Something that was done or seen. at_s: seconds since 1970 on this machine's clock."""

    at_s: float
    what: str
    fields: dict[str, Any]


@dataclass
class History:
    """A file that only grows. Any thread may append."""

    path: Path
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def append(self, what: str, **fields: object) -> None:
        """Write a line and hand it to the kernel at once: no crash of this process loses it."""
        line = json.dumps({"at_s": time.time(), "what": what, **fields}, default=str)
        with self._lock, self.path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")

    def entries(self) -> list[Entry]:
        """Return every line so far."""
        return [_entry(line) for line in self.path.read_text("utf-8").splitlines()]


def _entry(line: str) -> Entry:
    fields = json.loads(line)
    return Entry(fields.pop("at_s"), fields.pop("what"), fields)
