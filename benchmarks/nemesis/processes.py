"""hi5's own processes, each of which may be killed and started again any number of times."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from hi5_common.settings import Settings
from tests.support.fleet import (
    QUIET,
    descendants,
    environment,
    kill,
    pool_processes,
    render_children,
)

ROOT = Path(__file__).parents[2]


@dataclass
class Process:
    """A program of the fleet and the process that runs it now, if any does.

    Every process it ever had writes to the same log.
    """

    name: str
    module: tuple[str, ...]
    environment: Mapping[str, str]
    folder: Path
    popen: "subprocess.Popen[bytes] | None" = None
    wanted: bool = False
    """Whether it should run: what ends while it is wanted ended by itself."""

    def start(self) -> None:
        """Start it, the process before it being killed; return at once."""
        if self.popen is not None:
            self.popen.wait()
        with self.log_path.open("ab") as log:
            self.popen = subprocess.Popen(
                [sys.executable, "-m", *self.module],
                stdout=log,
                stderr=log,
                cwd=ROOT,
                env=dict(self.environment),
                start_new_session=True,
            )
        self.wanted = True

    @property
    def log_path(self) -> Path:
        return self.folder / f"{self.name}.log"

    @property
    def pid(self) -> int:
        """The id of the process that runs, or last ran."""
        if self.popen is None:
            raise RuntimeError(f"{self.name} was never started")
        return self.popen.pid

    def exit_code(self) -> int | None:
        """Return how it ended; None while it runs."""
        return None if self.popen is None else self.popen.poll()

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal after which it may end."""
        self.wanted = self.wanted and number in {signal.SIGSTOP, signal.SIGCONT}
        kill(self.pid, number)

    def end(self) -> None:
        """Kill -9 it and everything below it; return when it is gone."""
        self.wanted = False
        if self.popen is None:
            return
        for pid in (self.pid, *descendants(self.pid)):
            kill(pid)
        self.popen.wait()


@dataclass
class Fleet:
    """An API, some keepers and some workers.

    worker_app, keeper_module: what runs as worker and keeper. variables: for their environment.
    """

    settings: Settings
    folder: Path
    port: int
    worker_count: int
    keeper_count: int = 1
    worker_app: str = "services.worker.celery_app"
    keeper_module: str = "services.worker.keeper"
    variables: Mapping[str, str] = field(default_factory=dict)
    api: Process = field(init=False)
    keepers: list[Process] = field(init=False)
    workers: list[Process] = field(init=False)

    def __post_init__(self) -> None:
        serve = ("uvicorn", "services.api.main:create_app", "--factory", "--host", "127.0.0.1")
        self.api = self._process("api", *serve, "--port", str(self.port), "--no-access-log")
        self.keepers = [
            self._process(f"keeper-{number}", self.keeper_module)
            for number in range(self.keeper_count)
        ]
        worker = ("celery", "-A", self.worker_app, "worker", *QUIET)
        self.workers = [
            self._process(f"worker-{number}", *worker) for number in range(self.worker_count)
        ]

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def all(self) -> list[Process]:
        return [self.api, *self.keepers, *self.workers]

    def start(self) -> None:
        """Start everything."""
        for process in self.all:
            process.start()

    def end(self) -> None:
        """Kill everything."""
        for process in self.all:
            process.end()
        for pid in self.strays():
            kill(pid)

    def strays(self) -> list[int]:
        """Return the ids of processes of ours whose parent is gone, as their environment tells."""
        mark = f"TMPDIR={self.settings.data_dir}\0".encode()
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            with suppress(OSError):  # ended meanwhile
                if mark in (folder / "environ").read_bytes():
                    found.append(int(folder.name))
        return found

    def render_children(self, worker: Process) -> list[int]:
        """Return the process ids of a worker's render children."""
        return render_children(worker.pid, self.settings)

    def busy_pool(self, worker: Process) -> list[int]:
        """Return the process ids of a worker's pool that have a render child."""
        return pool_processes(worker.pid, self.settings)

    def died(self) -> list[Process]:
        """Return the processes that ended although nobody asked them to."""
        return [each for each in self.all if each.wanted and each.exit_code() is not None]

    def _process(self, name: str, *module: str) -> Process:
        variables = {**environment(self.settings), **self.variables, "PYTHONPATH": str(ROOT)}
        return Process(name, module, variables, self.folder)


def exists(pid: int) -> bool:
    """Return whether a process with this id is there."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
