"""What became of render children: a line of log each, and sums that `hi5 doctor` can read."""

import json
import logging
import os
import platform
import time
from collections import Counter
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from hi5_common.domain.faults import ImageFault

log = logging.getLogger(__name__)

_KEPT_S = 86400.0
"""Sums of processes that have ended are kept so long."""


class Ended(StrEnum):
    """How a child ended that was not at fault."""

    DONE = "done"
    WORN_OUT = "worn_out"
    """It had made child_images images, or grown beyond child_memory_mb."""
    ABANDONED = "abandoned"
    """Its attempt ended: lease lost, cancelled, drained, or the machine at fault."""


ChildEnd = Ended | ImageFault


@dataclass(frozen=True)
class ChildRecord:
    """One child that has ended. slope_mb: megabytes an image, None after too few images.

    network: as in child_events.Ready; "unknown" if the child never was ready.
    """

    pid: int
    end: ChildEnd
    images: int
    peak_mb: float
    slope_mb: float | None
    network: str


@dataclass
class ChildLedger:
    """Keeps the sums over all children of this process in a file of the health folder."""

    folder: Path
    ends: Counter[str] = field(default_factory=Counter)
    images: int = 0
    peak_mb: float = 0.0
    slope_mb: float | None = None
    network: str = "unknown"

    @property
    def path(self) -> Path:
        """The file of this very process."""
        return self.folder / f"children-{platform.node()}-{os.getpid()}.json"

    def add(self, record: ChildRecord) -> None:
        """Take in one child. A file that cannot be written is a line of log, no more."""
        self.ends[record.end.value] += 1
        self.images += record.images
        self.peak_mb = max(self.peak_mb, record.peak_mb)
        self.slope_mb = self.slope_mb if record.slope_mb is None else record.slope_mb
        if record.network != "unknown":
            self._note_network(record.network)
        log_end(record)
        try:
            self._write()
        except OSError as error:
            log.warning("sums of render children not written: %s", error)

    def _note_network(self, network: str) -> None:
        if network not in {"none", self.network}:
            log.warning("render children can reach the network: %s", network)
        self.network = network

    def _write(self) -> None:
        document = {
            "children": self.ends.total(),
            "ends": dict(self.ends),
            "images": self.images,
            "peak_mb": round(self.peak_mb, 1),
            "slope_mb_per_image": None if self.slope_mb is None else round(self.slope_mb, 4),
            "network": self.network,
        }
        self.folder.mkdir(parents=True, exist_ok=True)
        partial = self.path.with_suffix(".partial")
        partial.write_text(json.dumps(document) + "\n", encoding="utf-8")
        partial.replace(self.path)
        for path in self.folder.glob(f"children-{platform.node()}-*.json"):
            if time.time() - path.stat().st_mtime > _KEPT_S:
                path.unlink(missing_ok=True)


def log_end(record: ChildRecord) -> None:
    """Write one line about a child that has ended."""
    slope = "" if record.slope_mb is None else f", {record.slope_mb:+.3f} MB an image"
    log.info(
        "render child ended: %s after %d images, %.0f MB at most%s",
        record.end.value,
        record.images,
        record.peak_mb,
        slope,
        extra={"action": "child_end", "end": record.end.value, "pid": record.pid},
    )
