"""From times and errors to what is said of them: medians, spreads, the front, ratios."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from statistics import median
from typing import Any

from services.worker.bench.errors import Errors
from services.worker.bench.ways import Way


@dataclass(frozen=True)
class Measured:
    """A way on one scene: its errors, and the seconds of each repeat by phase."""

    index: int
    errors: Errors
    times_s: list[dict[str, float]]

    @property
    def seconds(self) -> float:
        """Return the median time of the whole image."""
        return median(row["total"] for row in self.times_s)

    @property
    def spread(self) -> float:
        """Return the range of the repeats as a share of their median."""
        totals = [row["total"] for row in self.times_s]
        return (max(totals) - min(totals)) / median(totals)

    @property
    def overhead(self) -> float:
        """Return the share of the image's time that is neither sampling nor denoising."""
        return median(1.0 - row.get("cycles_sample", 0.0) / row["total"] for row in self.times_s)


@dataclass(frozen=True)
class Result:
    """A way on all scenes."""

    way: Way
    scenes: tuple[Measured, ...]

    @property
    def seconds(self) -> float:
        """Return the median over scenes of their median time."""
        return median(scene.seconds for scene in self.scenes)

    def errors(self, name: str) -> float:
        """Return the median over scenes of an error by name."""
        return float(median(getattr(scene.errors, name) for scene in self.scenes))

    def on(self, indices: Sequence[int]) -> "Result":
        """Return what was measured on some scenes."""
        return Result(self.way, tuple(s for s in self.scenes if s.index in indices))

    def worst_db(self) -> float:
        """Return the lowest PSNR of a scene."""
        return min(scene.errors.psnr_db for scene in self.scenes)

    def document(self) -> dict[str, Any]:
        """Return all of it as JSON values."""
        return {
            "way": asdict(self.way),
            "median_s": self.seconds,
            "median_overhead": median(scene.overhead for scene in self.scenes),
            "median_errors": {name: self.errors(name) for name in Errors.__dataclass_fields__},
            "worst_psnr_db": self.worst_db(),
            "phases_s": phases(self.scenes),
            "scenes": [
                {
                    "index": scene.index,
                    "median_s": scene.seconds,
                    "spread": scene.spread,
                    "errors": asdict(scene.errors),
                    "times_s": scene.times_s,
                }
                for scene in self.scenes
            ],
        }


def phases(scenes: Sequence[Measured]) -> dict[str, float]:
    """Return the mean seconds of each phase over scenes and repeats."""
    rows = [row for scene in scenes for row in scene.times_s]
    names = sorted({name for row in rows for name in row})
    return {name: sum(row.get(name, 0.0) for row in rows) / len(rows) for name in names}


def pareto(results: Sequence[Result]) -> list[Result]:
    """Return the ways that no other beats in both time and PSNR, from the fastest on."""
    best: list[Result] = []
    for result in sorted(results, key=lambda r: (r.seconds, -r.errors("psnr_db"))):
        if not best or result.errors("psnr_db") > best[-1].errors("psnr_db"):
            best.append(result)
    return best


@dataclass(frozen=True)
class Speedup:
    """How much faster than the straightforward way at the same error, on one scene.

    at_bound: the straightforward way was never as good (or never as bad), so its nearest point
    stands for it and the ratio is too small (or too great by less than its fewest samples).
    """

    index: int
    ratio: float
    at_bound: bool


def speedups(result: Result, straightforward: Sequence[Result]) -> list[Speedup]:
    """Compare at equal PSNR, scene by scene, along the straightforward way's own curve."""
    found = []
    for scene in result.scenes:
        points = sorted(
            (other.errors.psnr_db, other.seconds)
            for way in straightforward
            for other in way.scenes
            if other.index == scene.index
        )
        seconds, at_bound = seconds_at(scene.errors.psnr_db, points)
        found.append(Speedup(scene.index, seconds / scene.seconds, at_bound))
    return found


def seconds_at(psnr_db: float, points: Sequence[tuple[float, float]]) -> tuple[float, bool]:
    """Return the time at a PSNR, log-linear between points (dB, s); True beyond their ends."""
    if psnr_db <= points[0][0]:
        return points[0][1], True
    if psnr_db >= points[-1][0]:
        return points[-1][1], True
    for (low_db, low_s), (high_db, high_s) in pairwise(points):
        if low_db <= psnr_db <= high_db:
            share = (psnr_db - low_db) / max(high_db - low_db, 1e-9)
            return math.exp((1 - share) * math.log(low_s) + share * math.log(high_s)), False
    raise ValueError(f"{psnr_db} dB lies between no two of {points}.")
