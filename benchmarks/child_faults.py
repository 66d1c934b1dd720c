"""Strike real render children while a dataset is made; its bytes must be those of a quiet run.

    python -m benchmarks.child_faults --seed 1
    python -m benchmarks.child_faults --kills 10 --crashes 10 --hangs 3 --memory 3 --disks 2

One slot on SQLite and a folder as store, real Blender, 64 × 64 pixels. Ends with 1 if a byte
differs, an image was drawn again or a fault did not strike.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from numpy.random import Generator

from hi5_common.db import datasets, migrate, shards
from hi5_common.db.engine import Database, open_database
from hi5_common.domain.faults import ImageFault
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.settings import Settings
from hi5_common.storage.open import open_store
from hi5_common.storage.publish import verify
from services.worker.fleet.shard_runner import ShardRunner

CHILD = "benchmarks.growing_child"
LIMIT_MB = 2000
PER_SHARD = 12
PER_ATTEMPT = PER_SHARD // 2 - 1
"""So few faults an attempt that none can meet the same image three times."""
LOOK_S = 0.02
TMPFS_MB = 48
UNFINISHED = frozenset({DatasetStatus.PENDING, DatasetStatus.RUNNING})

Strike = Callable[[int, Path], None]


def send(number: signal.Signals) -> Strike:
    return lambda pid, _: os.kill(pid, number)


def ask_to_grow(_: int, attempt: Path) -> None:
    (attempt / "tmp" / "grow").touch()


def fill_disk(_: int, attempt: Path) -> None:
    """Fill the private file system of the scratch folder, or lead what is to be written nowhere."""
    scratch = attempt.parent
    if scratch.is_mount():
        with suppress(OSError), (scratch / "filler").open("wb", buffering=0) as filler:
            while True:
                filler.write(bytes(4096))
    else:
        for index in range(1000):
            with suppress(FileExistsError):
                (attempt / "images" / f".{index:09d}.jpg.partial").symlink_to("/dev/full")


@dataclass(frozen=True)
class Kind:
    """A kind of fault: what it does to a child, and what the fleet has to call it."""

    name: str
    strike: Strike
    meaning: ImageFault


KINDS = (
    Kind("kills", send(signal.SIGKILL), ImageFault.CRASH),
    Kind("crashes", send(signal.SIGSEGV), ImageFault.CRASH),
    Kind("hangs", send(signal.SIGSTOP), ImageFault.HANG),
    Kind("memory", ask_to_grow, ImageFault.OUT_OF_MEMORY),
    Kind("disks", fill_disk, ImageFault.DISK_FULL),
)
ISSUE = {"kills": 10, "crashes": 10, "hangs": 3, "memory": 3, "disks": 2}


@dataclass
class Slot:
    """One slot of a worker with a database, a store and a scratch folder of its own."""

    runner: ShardRunner
    dataset_id: UUID

    def finish(self) -> DatasetStatus:
        """Work until the dataset needs no more; return how it ended."""
        while True:
            with self.runner.database.snapshot() as session:
                status = datasets.get(session, self.dataset_id).status
            if status not in UNFINISHED:
                return status
            if self.runner.run_next(None) is None:
                time.sleep(0.1)

    def published(self) -> dict[int, tuple[str, ...]]:
        """Return the SHA-256 of each shard's objects, each read back; fail on a redraw or gap."""
        found = {}
        with self.runner.database.snapshot() as session:
            rows = shards.of_dataset(session, self.dataset_id, 10_000)
        for row in rows:
            made = row.publication
            if made is None or made.gaps or made.redraws:
                raise SystemExit(f"shard {row.number} is not whole: {row}")
            objects = (made.samples, made.labels, made.members)
            for stored in objects:
                verify(self.runner.store, stored)
            found[row.number] = tuple(stored.sha256 for stored in objects)
        return found


@contextmanager
def slot(spec: DatasetSpec, scratch: Path, folder: Path, image_timeout_s: float) -> Iterator[Slot]:
    settings = Settings(
        data_dir=folder,
        scratch_dir=scratch,
        child_module=CHILD,
        image_timeout_s=image_timeout_s,
        child_memory_mb=LIMIT_MB,
        child_memory_limit_mb=LIMIT_MB,
    )
    url = settings.resolved_database_url
    folder.mkdir(parents=True, exist_ok=True)
    migrate.upgrade(url)
    database: Database = open_database(url)
    try:
        with database.transaction() as session:
            made = datasets.create(session, spec, Plan.of(spec)).dataset
        runner = ShardRunner(database, open_store(settings), settings, "bench", lambda: False)
        yield Slot(runner, made.id)
    finally:
        database.dispose()


@dataclass
class Injector:
    """Strikes children of this process one after the other, each in the middle of its work."""

    slot: Slot
    scratch: Path
    wanted: list[Kind]
    rng: Generator
    stop: threading.Event = field(default_factory=threading.Event)
    struck: Counter[str] = field(default_factory=Counter)
    per_attempt: Counter[Path] = field(default_factory=Counter)
    seen: dict[Path, int] = field(default_factory=dict)

    def run(self) -> None:
        while self.wanted and not self.stop.is_set():
            target = self._target()
            if target is not None and self._strike(self.wanted[-1], *target):
                self.struck[self.wanted.pop().name] += 1
            self.stop.wait(LOOK_S)

    def _target(self) -> tuple[int, Path] | None:
        """Return a child that has made an image since the last fault, and has some to make."""
        for pid in children():
            for attempt in self.scratch.glob("hi5-attempt-*[!k]"):
                made = len(list((attempt / "images").glob("*.json")))
                fresh = self.seen.get(attempt, 0) < made < PER_SHARD - 2
                if fresh and self.per_attempt[attempt] < PER_ATTEMPT:
                    self.seen[attempt] = made
                    return pid, attempt
        return None

    def _strike(self, kind: Kind, pid: int, attempt: Path) -> bool:
        """Strike and wait until the child is gone; return whether this fault was what ended it."""
        ends = self.slot.runner.ledger.ends
        before, total = ends[kind.meaning.value], ends.total()
        time.sleep(self.rng.uniform(0.0, 0.3))
        with suppress(OSError):  # it, or its folder, may be gone by now
            kind.strike(pid, attempt)
        while ends.total() == total and not self.stop.is_set():
            time.sleep(LOOK_S)
        (self.scratch / "filler").unlink(missing_ok=True)
        self.per_attempt[attempt] += 1
        self.seen[attempt] = len(list((attempt / "images").glob("*.json")))
        return ends[kind.meaning.value] > before


def children() -> list[int]:
    """Return the render children of this process."""
    found = []
    for path in Path("/proc/self/task").glob("*/children"):
        for pid in path.read_text("ascii").split():
            with suppress(OSError):
                if CHILD.encode() in Path(f"/proc/{pid}/cmdline").read_bytes():
                    found.append(int(pid))
    return found


@contextmanager
def small_disk(folder: Path) -> Iterator[Path]:
    """Yield a scratch folder on a file system of its own where this user may mount one."""
    folder.mkdir(parents=True)
    size = f"size={TMPFS_MB}m"
    mounted = (
        os.geteuid() == 0
        and subprocess.run(
            ["mount", "-t", "tmpfs", "-o", size, "hi5-faults", folder],
            check=False,
            capture_output=True,
        ).returncode
        == 0
    )
    try:
        yield folder
    finally:
        if mounted:
            subprocess.run(["umount", "--lazy", folder], check=True)


def dataset_spec(count: int) -> DatasetSpec:
    return parse_spec(
        {
            "name": "faults",
            "count": count,
            "seed": 6,
            "images_per_shard": PER_SHARD,
            "image": {"width": 64, "height": 64},
            "render": {"quality": "draft"},
            "attributes": {"environment": ["city", "courtyard"]},  # they come with bpy: no bake
        }
    )


def compare(
    folder: Path, wanted: Mapping[str, int], seed: int, image_timeout_s: float
) -> Counter[str]:
    """Make a dataset twice, quietly and under fire; return the faults that struck, by kind.

    Raises SystemExit if they are not those that were wanted, or a byte differs.
    """
    rng = factor_rng(seed, 0, "faults")
    ordered = [kind for kind in KINDS for _ in range(wanted.get(kind.name, 0))]
    faults = [ordered[place] for place in rng.permutation(len(ordered))]
    attempts = -(-len(faults) // PER_ATTEMPT) + 1
    spec = dataset_spec(PER_SHARD * attempts)
    began_s = time.monotonic()
    with slot(spec, folder / "quiet-scratch", folder / "quiet", image_timeout_s) as quiet:
        assert_complete(quiet)
        expected = quiet.published()
    told(f"quiet run of {spec.count} images: {time.monotonic() - began_s:.0f} s")
    began_s = time.monotonic()
    with (
        small_disk(folder / "scratch") as scratch,
        slot(spec, scratch, folder / "struck", image_timeout_s) as struck,
    ):
        injector = Injector(struck, scratch, faults, rng)
        thread = threading.Thread(target=injector.run, name="injector")
        thread.start()
        try:
            assert_complete(struck)
        finally:
            injector.stop.set()
            thread.join()
        left = list(scratch.glob("hi5-attempt-*"))
        told(f"struck run: {time.monotonic() - began_s:.0f} s, {dict(struck.runner.ledger.ends)}")
        if struck.published() != expected:
            raise SystemExit("the bytes of the struck run differ from the quiet one's")
    if faults or left or children():
        raise SystemExit(f"not struck: {faults}; left behind: {left}, {children()}")
    return injector.struck


def assert_complete(one: Slot) -> None:
    status = one.finish()
    if status is not DatasetStatus.COMPLETE:
        raise SystemExit(f"the dataset is {status}")


def told(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--image-timeout-s", type=float, default=40.0)
    for name, count in ISSUE.items():
        parser.add_argument(f"--{name}", type=int, default=count)
    asked = vars(parser.parse_args())
    wanted = {name: asked[name] for name in ISSUE}
    folder = Path(tempfile.mkdtemp(prefix="hi5-child-faults-"))
    try:
        struck = compare(folder, wanted, asked["seed"], asked["image_timeout_s"])
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    told(f"seed {asked['seed']}: struck {dict(struck)}; every byte is that of the quiet run")


if __name__ == "__main__":
    main()
