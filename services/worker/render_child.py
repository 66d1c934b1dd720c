"""The supervised render process: one job in, image files out, one JSON line an event on fd 3.

Blender can crash, hang or leak; this process is where it may. It reads one line of JSON on
standard input, renders, reports, and leaves by os._exit, so that a crash in Blender's own exit can
never turn a finished job into a failed one. Standard output belongs to Blender's chatter.
"""

import ctypes
import faulthandler
import hashlib
import json
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Mapping
from contextlib import suppress
from itertools import zip_longest
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from hi5_common.domain.errors import Hi5Error
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec
from hi5_common.settings import RendererName
from services.worker.outcome import fault_of, write_sample
from services.worker.sample import Sample, Studio
from services.worker.scene.sampling import Take
from services.worker.seclusion import SeclusionRefused, refuse_network
from services.worker.studio import open_studio

EVENTS_FD = 3
_PR_SET_PDEATHSIG = 1
_MAX_DETAIL = 500


class Job(BaseModel):
    """What to render. `fault` is reserved for children of tests; this one has none built in."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    spec: DatasetSpec
    indices: tuple[int, ...]
    out_dir: Path
    threads: int = Field(ge=1)
    renderer: RendererName
    cache_dir: Path
    assets_dir: Path | None = None
    device: str = "cpu"
    calibration: Path | None = None
    fault: None = None
    draws: dict[int, int] = Field(default_factory=dict)
    network: bool = False
    """Whether this process may open sockets; without need it takes them from itself."""

    def take(self, index: int) -> Take:
        """Return an image with the draw of its cell that is wanted."""
        return Take(index, self.draws.get(index, 0))


def main() -> None:
    """Do the job on standard input, then leave at once."""
    faulthandler.enable()
    bind_to_parent()
    try:
        run(Job.model_validate_json(sys.stdin.readline()))
    except Exception as error:  # noqa: BLE001  the process boundary: the log gets all
        _log_trace()
        send({"event": "broken", **_told(error)})
        leave(1)
    leave(0)


def run(job: Job) -> None:
    """Render every image of a job. A failed image is reported and does not stop the others."""
    network = seclude(job.network)
    plan = Plan.of(job.spec)
    first = next((plan.cell(i).gender for i in job.indices if 0 <= i < job.spec.count), None)
    studio = open_studio(
        job.renderer,
        job.threads,
        job.cache_dir,
        job.assets_dir,
        first=first,
        device=job.device,
        calibration=job.calibration,
    )
    job.out_dir.mkdir(parents=True, exist_ok=True)
    versions = studio.renderer.versions
    send({"event": "ready", "pid": os.getpid(), "renderer": versions, "network": network})
    pairs = zip_longest(job.indices, job.indices[1:])
    made = sum(
        _attempt(studio, job, plan, job.take(index), None if then is None else job.take(then))
        for index, then in pairs
    )
    send({"event": "done", "images": made})


def bind_to_parent() -> None:
    """Die with the parent, be the first that the kernel kills for memory, leave no core file."""
    parent = os.getppid()
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        leave(1)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")


def seclude(network: bool) -> str:
    """Take the network from this process unless it is allowed; return what came of it, in words."""
    if network:
        return "open: HI5_CHILD_NETWORK allows it"
    try:
        refuse_network()
    except SeclusionRefused as error:
        return f"open: {error}"
    return "none"


def send(event: Mapping[str, Any]) -> None:
    """Write one event. A parent that is gone ends this process by the error this raises."""
    line = json.dumps(event, separators=(",", ":")).encode() + b"\n"
    while line:
        line = line[os.write(EVENTS_FD, line) :]


def leave(code: int) -> None:
    """End the process without running anyone's exit handlers."""
    with suppress(OSError):  # a full disk must not turn a finished job into a failed one
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


def _attempt(studio: Studio, job: Job, plan: Plan, take: Take, then: Take | None) -> bool:
    started = time.perf_counter()
    try:
        sample = studio.make_sample(job.spec, plan, take, then=then)
        write_sample(sample, job.out_dir, job.out_dir)
    except Exception as error:  # noqa: BLE001  the process boundary: one image must not stop a job
        _log_trace()
        send({"event": "failed", "index": take.index, **_told(error)})
        return False
    send(_image_event(sample, time.perf_counter() - started))
    return True


def _told(error: Exception) -> dict[str, str]:
    words = str(error) if isinstance(error, Hi5Error) else f"{type(error).__name__}: {error}"
    return {"fault": fault_of(error).value, "detail": words[:_MAX_DETAIL]}


def _log_trace() -> None:
    with suppress(OSError):  # the log's disk may be the one that is full
        traceback.print_exc()


def _image_event(sample: Sample, seconds: float) -> dict[str, Any]:
    return {
        "event": "image",
        "index": sample.index,
        "image_sha256": hashlib.sha256(sample.image).hexdigest(),
        "label_sha256": hashlib.sha256(sample.label_json).hexdigest(),
        "image_bytes": len(sample.image),
        "label_bytes": len(sample.label_json),
        "seconds": round(seconds, 4),
        "phases_s": {name: round(value, 4) for name, value in sample.phases_s.items()},
        "rss_mb": round(_rss_mb(), 1),
    }


def _rss_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 2**20


if __name__ == "__main__":
    main()
