"""Signs of life of long-running processes: files whose age says when they last did their duty."""

import os
import platform
import time
from dataclasses import dataclass
from pathlib import Path

FRESH_S = 60.0


@dataclass(frozen=True)
class Heartbeat:
    """The sign of life of one process of a role ("worker", "keeper") on this machine."""

    folder: Path
    role: str

    @property
    def path(self) -> Path:
        """The file of this very process."""
        return self.folder / f"{self.role}-{platform.node()}-{os.getpid()}.beat"

    def beat(self, problem: str | None = None) -> None:
        """Say that this process did its duty just now, or what kept it from it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.path.write_text(problem or "", encoding="utf-8")

    def end(self) -> None:
        """Say that this process ends in order."""
        self.path.unlink(missing_ok=True)

    def problem(self) -> str | None:
        """Return why no process of this role is healthy here, or None if one is."""
        beats = {path: path.stat().st_mtime for path in self._paths()}
        if not beats:
            return f"no {self.role} has run here: {self.folder} has no sign of life"
        newest = max(beats, key=beats.__getitem__)
        age_s = time.time() - beats[newest]
        if age_s > FRESH_S:
            return f"the {self.role} has done nothing for {age_s:.0f} s"
        return newest.read_text(encoding="utf-8") or None

    def _paths(self) -> list[Path]:
        return list(self.folder.glob(f"{self.role}-{platform.node()}-*.beat"))
