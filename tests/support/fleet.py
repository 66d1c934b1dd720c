"""A fleet of real processes over real servers: workers, a keeper, and what to do to them."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from hi5_common.db import datasets, events, shards
from hi5_common.db.engine import Database
from hi5_common.domain import keys
from hi5_common.domain.records import Dataset, DatasetStatus, Shard
from hi5_common.settings import Settings
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.publish import verify
from services.worker.keeper import Keeper

APP = "services.worker.celery_app"
POLLER = "services.worker.fleet.poller"
QUIET = ("--without-gossip", "--without-mingle", "--loglevel", "INFO")
PATIENCE_S = 60.0


@dataclass
class Fleet:
    """The processes a test has started, and the database and store they share."""

    settings: Settings
    database: Database
    store: ObjectStore
    keeper: Keeper
    folder: Path
    processes: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def start_keeper(self) -> subprocess.Popen[bytes]:
        return self._start("keeper", ("services.worker.keeper",))

    def start_worker(self, app: str = APP) -> subprocess.Popen[bytes]:
        return self._start("worker", ("celery", "-A", app, "worker", *QUIET))

    def stop(self) -> None:
        """Kill every process that still runs."""
        for process in self.processes:
            for pid in (process.pid, *descendants(process.pid)):
                kill(pid)
            process.wait()

    def dataset(self, dataset_id: UUID) -> Dataset:
        with self.database.snapshot() as session:
            return datasets.get(session, dataset_id)

    def shards(self, dataset_id: UUID) -> list[Shard]:
        with self.database.snapshot() as session:
            return shards.of_dataset(session, dataset_id, 1000)

    def kinds(self, dataset_id: UUID) -> list[str]:
        """Return what happened to the shards of a dataset, in order."""
        with self.database.snapshot() as session:
            history = events.of_dataset(session, dataset_id, 10_000)
        return [event.kind for event in history if event.shard_number is not None]

    def wait_for_claim(self, dataset_id: UUID) -> None:
        """Wait until a worker has begun. Short shards may end before they report any progress."""
        wait_until(lambda: "claim" in self.kinds(dataset_id), self.log)

    def wait_for_progress(self, dataset_id: UUID, images: int = 1) -> None:
        """Wait until a worker has reported images of a shard it still holds."""
        wait_until(lambda: self.dataset(dataset_id).images_in_progress >= images, self.log)

    def wait_for_completion(self, dataset_id: UUID) -> None:
        """Wait as long as something happens: how long an image takes is the machine's affair."""

        def far() -> tuple[DatasetStatus, int, int]:
            found = self.dataset(dataset_id)
            return found.status, found.images_done, found.images_in_progress

        def further() -> bool:
            return far() != seen

        seen = far()
        while seen[0] is not DatasetStatus.COMPLETE:
            wait_until(further, self.log)
            seen = far()

    def assert_published_once(self, dataset_id: UUID) -> None:
        """Check every object against its row, and that nothing is missing or double."""
        self.keeper.sweep_objects()
        expected: set[str] = set()
        indices: list[int] = []
        for shard in self.shards(dataset_id):
            publication = shard.publication
            assert publication is not None
            for stored in (publication.samples, publication.labels, publication.members):
                verify(self.store, stored)
                expected.add(stored.key)
            indices += range(shard.start, shard.stop)
        assert indices == list(range(self.dataset(dataset_id).spec.count))
        assert {e.key for e in self.store.list(keys.dataset_prefix(dataset_id))} == expected
        assert self.kinds(dataset_id).count("finish") == len(self.shards(dataset_id))

    def log(self) -> str:
        """Return the last lines of every process's log."""
        return "\n".join(
            f"== {path.name}\n{path.read_text('utf-8', 'replace')[-3000:]}"
            for path in sorted(self.folder.glob("*.log"))
        )

    def _start(self, name: str, module: tuple[str, ...]) -> subprocess.Popen[bytes]:
        path = self.folder / f"{name}-{len(self.processes)}.log"
        with path.open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", *module],
                stdout=log,
                stderr=log,
                env=environment(self.settings),
                start_new_session=True,
            )
        self.processes.append(process)
        return process


@contextmanager
def running(fleet: Fleet) -> Iterator[Fleet]:
    """Stop every process in the end, whatever happened."""
    try:
        yield fleet
    finally:
        fleet.stop()


def environment(settings: Settings) -> dict[str, str]:
    """Return the variables that make a process have these settings."""
    own = {
        f"HI5_{name.upper()}": str(value)
        for name, value in settings.model_dump(mode="json").items()
        if value is not None
    }
    outer = {name: os.environ[name] for name in ("PATH", "HOME")}
    return outer | own | {"TMPDIR": str(settings.data_dir)}  # what a kill leaves behind goes too


def wait_until(condition: Callable[[], bool], explain: Callable[[], str]) -> None:
    """Wait for something to become true; fail with an explanation if it never does."""
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s, explain()
        time.sleep(0.05)


def descendants(pid: int) -> list[int]:
    """Return the children of a process and all of theirs, the parents first."""
    try:
        paths = list(Path(f"/proc/{pid}/task").glob("*/children"))
        found = [int(child) for path in paths for child in path.read_text("utf-8").split()]
    except OSError:
        return []
    return found + [deeper for child in found for deeper in descendants(child)]


def command_line(pid: int) -> str:
    """Return the command of a process, or nothing if it is gone."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text("utf-8").replace("\0", " ")
    except OSError:
        return ""


def render_children(worker_pid: int, settings: Settings) -> list[int]:
    """Return the render children below a worker."""
    return [pid for pid in descendants(worker_pid) if settings.child_module in command_line(pid)]


def pollers(worker_pid: int) -> list[int]:
    """Return the process below a worker that asks the database for work."""
    return [pid for pid in descendants(worker_pid) if POLLER in command_line(pid)]


def pool_processes(worker_pid: int, settings: Settings) -> list[int]:
    """Return the worker's own processes that supervise render children."""
    children = render_children(worker_pid, settings)
    return [pid for pid in descendants(worker_pid) if set(descendants(pid)) & set(children)]


def kill(pid: int, number: signal.Signals = signal.SIGKILL) -> None:
    """Send a signal to a process that may be gone already."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return
