"""Many frames in one worker's slot: does anything grow, does anything stay behind?

    python -m benchmarks.soak --frames 2000

Real Blender, 64 × 64 pixels, shards of 200, a fresh child after 80 images. Prints the supervising
process's memory after each shard and its slope, the slopes of the children, and what was left.
Ends with 1 if the supervisor grows, a child was not replaced in time, or anything was left.
"""

import argparse
import gc
import os
import shutil
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from statistics import linear_regression, median

from benchmarks.slot import children_of_this_process, open_slot, small_frames
from hi5_common.settings import Settings
from services.worker.fleet.child_memory import memory_mb
from services.worker.fleet.child_records import ChildLedger, ChildRecord, Ended

MOST_MB_PER_1000 = 5.0


@dataclass
class Recording(ChildLedger):
    """A ledger that keeps every record."""

    records: list[ChildRecord] = field(default_factory=list)

    def add(self, record: ChildRecord) -> None:
        self.records.append(record)
        super().add(record)


@dataclass(frozen=True)
class Possessions:
    """What a process has that it could forget to give back."""

    descriptors: int
    threads: int
    children: int
    folders: tuple[str, ...]

    @classmethod
    def now(cls, module: str, scratch: Path, temporary: Path) -> "Possessions":
        gc.collect()
        left = [*scratch.glob("hi5-attempt-*"), *temporary.iterdir()]
        return cls(
            len(list(Path("/proc/self/fd").iterdir())),
            len(threading.enumerate()),
            len(children_of_this_process(module)),
            tuple(sorted(path.name for path in left)),
        )


@dataclass
class Soak:
    """What was seen. supervisor_mb: (images done, megabytes) after each shard."""

    supervisor_mb: list[tuple[int, float]]
    records: list[ChildRecord]
    after_first: Possessions
    after_last: Possessions
    seconds: float

    @property
    def slope_mb_per_1000(self) -> float | None:
        """The supervisor's growth; the first fifth is warming up. None for too few shards."""
        later = self.supervisor_mb[len(self.supervisor_mb) // 5 :]
        if len(later) < 4:
            return None
        images, megabytes = zip(*later, strict=True)
        return linear_regression(images, megabytes).slope * 1000

    def ends(self) -> Counter[str]:
        return Counter(record.end.value for record in self.records)

    def told(self) -> str:
        slope = self.slope_mb_per_1000
        slopes = [r.slope_mb for r in self.records if r.slope_mb is not None]
        peak_mb = max(record.peak_mb for record in self.records)
        memory = ", ".join(f"{images}: {mb:.1f}" for images, mb in self.supervisor_mb)
        return "\n".join(
            [
                f"{self.supervisor_mb[-1][0]} images in {self.seconds:.0f} s",
                f"supervisor, MB after images: {memory}",
                "supervisor's slope, MB / 1000 images: "
                + ("too few shards" if slope is None else f"{slope:+.2f}"),
                f"children: {dict(self.ends())}, at most {peak_mb:.0f} MB",
                "children's slopes, MB / image: "
                + (
                    f"median {median(slopes):+.3f}, {min(slopes):+.3f} to {max(slopes):+.3f}"
                    if slopes
                    else "too few images"
                ),
                f"after the first shard: {self.after_first}",
                f"after the last shard:  {self.after_last}",
            ]
        )


def soak(folder: Path, frames: int, per_shard: int, child_images: int) -> Soak:
    """Render the frames in one slot."""
    temporary = folder / "tmp"
    temporary.mkdir(parents=True)
    scratch = folder / "scratch"
    settings = Settings(data_dir=folder / "data", scratch_dir=scratch, child_images=child_images)
    began_s = time.monotonic()
    seen: list[tuple[int, float]] = []
    had: list[Possessions] = []
    before, tempfile.tempdir = tempfile.tempdir, str(temporary)
    try:
        with open_slot(small_frames(frames, per_shard), settings) as slot:
            ledger = Recording(settings.health_dir)
            vars(slot.runner)["ledger"] = ledger
            while slot.step():
                if seen and seen[-1][0] == ledger.images:
                    continue
                had.append(Possessions.now(settings.child_module, scratch, temporary))
                seen.append((ledger.images, memory_mb(os.getpid())))
                print(f"{seen[-1][0]} images, {seen[-1][1]:.1f} MB, {had[-1]}", flush=True)
            return Soak(seen, ledger.records, had[0], had[-1], time.monotonic() - began_s)
    finally:
        tempfile.tempdir = before


def problems(result: Soak, frames: int, per_shard: int, child_images: int) -> list[str]:
    """Return what is not as it has to be."""
    found = []
    slope = result.slope_mb_per_1000
    if slope is not None and slope > MOST_MB_PER_1000:
        found.append(f"the supervisor grows by {slope:.1f} MB in 1000 images")
    shards = frames // per_shard
    worn_out = shards * ((per_shard - 1) // child_images)
    if result.ends() != {Ended.WORN_OUT.value: worn_out, Ended.DONE.value: shards}:
        found.append(
            f"children ended {dict(result.ends())}, not {worn_out} worn out, {shards} done"
        )
    if result.after_first != result.after_last or result.after_last.folders:
        found.append("something was left behind")
    if result.after_last.children:
        found.append("a child was left behind")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=2000)
    parser.add_argument("--per-shard", type=int, default=200)
    parser.add_argument("--child-images", type=int, default=80)
    asked = parser.parse_args()
    if asked.frames % asked.per_shard:
        parser.error("--frames has to be a multiple of --per-shard")
    folder = Path(tempfile.mkdtemp(prefix="hi5-soak-"))
    sizes = (asked.frames, asked.per_shard, asked.child_images)
    try:
        result = soak(folder, *sizes)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(result.told())
    if wrong := problems(result, *sizes):
        sys.exit("; ".join(wrong))


if __name__ == "__main__":
    main()
