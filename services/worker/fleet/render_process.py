"""One render child: a process of its own session that may crash, hang or leak without harm.

The worker never imports Blender. It starts the child with a clean environment (no credential ever
enters the process that parses scenes), reads its events from a pipe and kills its whole group.
"""

import json
import os
import selectors
import signal
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Self

from hi5_common.domain.faults import ImageFault
from hi5_common.domain.spec import DatasetSpec
from hi5_common.settings import Settings
from services.worker.fleet.child_events import ChildEvent, parse_event
from services.worker.fleet.child_memory import kernel_oom_kills, memory_mb

EVENTS_FD = 3
_KEPT = ("PATH", "LANG", "LD_LIBRARY_PATH", "CUDA_VISIBLE_DEVICES", "CUDA_CACHE_PATH")
_KEPT_PREFIXES = ("PYTHON", "LC_", "NVIDIA_", "OPTIX_")
_READ_BYTES = 1 << 16
_LOG_READ_BYTES = 1 << 16
_LOG_TAIL_CHARACTERS = 2000
_NOT_TOLD = "Extension modules: "


@dataclass(frozen=True)
class RenderJob:
    """What a child is told on its standard input, as one line of JSON.

    draws: which draw of its cell an image is; one that is not named is the first, 0.
    """

    spec: dict[str, Any]
    indices: tuple[int, ...]
    out_dir: str
    threads: int
    renderer: str
    cache_dir: str
    assets_dir: str | None = None
    device: str = "cpu"
    calibration: str | None = None
    fault: str | None = None
    draws: dict[int, int] = field(default_factory=dict)
    network: bool = False

    @classmethod
    def of(
        cls, settings: Settings, spec: DatasetSpec, indices: tuple[int, ...], out_dir: Path
    ) -> Self:
        """Return the job of some images of a spec, rendered as this machine's settings say."""
        return cls(
            spec=spec.model_dump(mode="json"),
            indices=indices,
            out_dir=str(out_dir),
            threads=settings.render_threads,
            renderer=settings.renderer.value,
            cache_dir=str(settings.cache_dir),
            assets_dir=str(settings.resolved_assets_dir),
            device=settings.device,
            calibration=None if settings.calibration is None else str(settings.calibration),
            network=settings.child_network,
        )


class ChildGone(Exception):
    """The child has ended; there are no more events."""


class RenderProcess:
    """A running child. Create it in the thread that lives longest: its death kills the child."""

    def __init__(self, job: RenderJob, folder: Path, command: Sequence[str]) -> None:
        self._folder = folder
        self._lines: deque[bytes] = deque()
        self._partial = b""
        self._status: int | None = None
        self._oom_kills_before = kernel_oom_kills()
        self._reader, writer = os.pipe()
        os.set_blocking(self._reader, False)
        try:
            self.pid = _spawn(command, job, folder, writer)
        except BaseException:
            os.close(self._reader)
            raise
        finally:
            os.close(writer)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._reader, selectors.EVENT_READ)

    def next_event(self, timeout_s: float) -> ChildEvent | None:
        """Return the next event, or None if none came in time.

        Raises ChildGone at the end and ProtocolError for a line that is no event.
        """
        if not self._lines:
            # A grandchild may hold the pipe open: the child's own end counts, not the pipe's.
            gone = self._poll() is not None
            readable = self._selector.select(0 if gone else timeout_s)
            if (not readable or not self._read()) and gone:
                raise ChildGone
        # Parsed one by one: a line that is no event must not cost those before it.
        return parse_event(self._lines.popleft()) if self._lines else None

    def kill(self) -> None:
        """Kill the child and all it has started; wait until it is gone."""
        self._signal_group()
        while self._poll() is None:
            time.sleep(0.01)
        self._signal_group()

    def close(self) -> None:
        """Kill the child and free its pipe."""
        self.kill()
        self._selector.close()
        os.close(self._reader)

    def memory_mb(self) -> float:
        """Return what the child and all it has started hold of the machine's memory."""
        return memory_mb(self.pid)

    def fault_of_end(self) -> ImageFault:
        """Return what an end means that nobody had asked for."""
        killed = (
            self._status is not None and os.waitstatus_to_exitcode(self._status) == -signal.SIGKILL
        )
        if killed and kernel_oom_kills() > self._oom_kills_before:
            return ImageFault.OUT_OF_MEMORY
        return ImageFault.CRASH

    def describe_end(self) -> str:
        """Return how the child ended, with the last lines of its log."""
        code = None if self._status is None else os.waitstatus_to_exitcode(self._status)
        match code:
            case None:
                how = "still running"
            case int() if code < 0:
                how = f"killed by {signal.Signals(-code).name}"
            case _:
                how = f"exit code {code}"
        return f"{how}; log: {_tail(log_path(self._folder))}"

    def _poll(self) -> int | None:
        if self._status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            self._status = status if pid else None
        return self._status

    def _signal_group(self) -> None:
        try:
            os.killpg(self.pid, signal.SIGKILL)
        except ProcessLookupError:
            return

    def _read(self) -> bool:
        """Take what is in the pipe; return False at its end."""
        try:
            data = os.read(self._reader, _READ_BYTES)
        except BlockingIOError:
            return False
        if not data and self._status is None:
            time.sleep(0.01)  # the pipe is closed and the child about to end
        *lines, self._partial = (self._partial + data).split(b"\n")
        self._lines.extend(line for line in lines if line.strip())
        return bool(data)


def log_path(folder: Path) -> Path:
    """Return where the children of an attempt write their standard output."""
    return folder / "child.log"


def _spawn(command: Sequence[str], job: RenderJob, folder: Path, writer: int) -> int:
    # The job comes from a file: a pipe could block on a child that never reads.
    job_path = folder / "job.json"
    job_path.write_text(json.dumps(asdict(job)) + "\n", encoding="utf-8")
    append = os.O_WRONLY | os.O_CREAT | os.O_APPEND
    return os.posix_spawn(
        command[0],
        list(command),
        clean_environment(os.environ, folder),
        file_actions=[
            (os.POSIX_SPAWN_DUP2, writer, EVENTS_FD),
            (os.POSIX_SPAWN_OPEN, 0, str(job_path), os.O_RDONLY, 0),
            (os.POSIX_SPAWN_OPEN, 1, str(log_path(folder)), append, 0o600),
            (os.POSIX_SPAWN_DUP2, 1, 2),
        ],
        setsid=True,
        setsigmask=(),
        setsigdef=(signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1),
    )


def clean_environment(inherited: Mapping[str, str], folder: Path) -> dict[str, str]:
    """Return what a child may know of our environment: no setting of hi5, no credential."""
    kept = {
        name: value
        for name, value in inherited.items()
        if name in _KEPT or name.startswith(_KEPT_PREFIXES)
    }
    temporary = folder / "tmp"
    temporary.mkdir(exist_ok=True)
    return {**kept, "HOME": str(temporary), "TMPDIR": str(temporary)}


def _tail(path: Path) -> str:
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - _LOG_READ_BYTES))
            lines = file.read().decode("utf-8", "replace").splitlines()
    except OSError:
        return "(none)"
    # A crash dump ends with the names of all modules: its stack, before them, is what matters.
    told = "\n".join(line for line in lines if not line.startswith(_NOT_TOLD)).strip()
    return told[-_LOG_TAIL_CHARACTERS:] or "(empty)"
