"""What a render child takes of the machine's memory, and how that grows."""

from dataclasses import dataclass, field
from pathlib import Path
from statistics import linear_regression

_LEAST_IMAGES = 8
"""Below so many a slope says nothing."""


@dataclass
class MemoryTrend:
    """The memory of one child after each of its images, in megabytes."""

    after_image_mb: list[float] = field(default_factory=list)

    @property
    def peak_mb(self) -> float:
        """The most it had after an image; 0 before the first."""
        return max(self.after_image_mb, default=0.0)

    @property
    def slope_mb(self) -> float | None:
        """Megabytes an image, by least squares over the later half: the first half is warming up.

        None when there are too few images to tell.
        """
        if len(self.after_image_mb) < _LEAST_IMAGES:
            return None
        later = self.after_image_mb[len(self.after_image_mb) // 2 :]
        return linear_regression(range(len(later)), later).slope


def memory_mb(pid: int) -> float:
    """Return what a process and all below it hold, in memory or swapped out; 0 if it is gone."""
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="ascii", errors="replace")
        children = [
            int(child)
            for path in Path(f"/proc/{pid}/task").glob("*/children")
            for child in path.read_text(encoding="ascii").split()
        ]
    except OSError:
        return 0.0
    own_kb = sum(
        int(line.split()[1])
        for line in status.splitlines()
        if line.startswith(("VmRSS:", "VmSwap:"))
    )
    return own_kb / 1024 + sum(memory_mb(child) for child in children)


def kernel_oom_kills() -> int:
    """Return how many processes the kernel has killed for memory since the machine's start."""
    try:
        counters = Path("/proc/vmstat").read_text(encoding="ascii")
    except OSError:
        return 0
    found = (line.split() for line in counters.splitlines())
    return next((int(value) for name, value in found if name == "oom_kill"), 0)
