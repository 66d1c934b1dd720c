"""Render children that a benchmark can hold still: what two ways take, measured side by side.

Other work on a machine slows it for minutes at a time, so that one way measured after another says
little. Children of both ways stay alive, and are stopped and let on by turns.
"""

import argparse
import os
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.settings import Settings
from services.worker.fleet.child_events import ImageRefused, ImageRendered
from services.worker.fleet.render_process import RenderJob, RenderProcess

PATIENCE_S = 600.0
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
PLACES = ("city", "courtyard", "forest", "interior")
"""Four that come with bpy: as many as a child keeps loaded, as in a shard ordered by place."""


@dataclass(frozen=True)
class Made:
    """One image: when it was done (seconds of a clock), and the child's processor seconds then."""

    event: ImageRendered
    at_s: float
    cpu_s: float


@dataclass
class Child:
    """A child and what it has made so far. A stopped one makes nothing and uses no processor."""

    process: RenderProcess
    made: list[Made] = field(default_factory=list)

    def next_image(self, timeout_s: float = PATIENCE_S) -> Made | None:
        """Return the next image, or None if there is none in time. Raises ChildGone."""
        give_up_s = time.monotonic() + timeout_s
        while (left_s := give_up_s - time.monotonic()) > 0:
            event = self.process.next_event(left_s)
            if isinstance(event, ImageRefused):
                raise SystemExit(f"image {event.index}: {event.reason}")
            if isinstance(event, ImageRendered):
                self.made.append(Made(event, time.perf_counter(), self._cpu_s()))
                return self.made[-1]
        return None

    def hold(self) -> None:
        """Stop it where it is."""
        os.killpg(self.process.pid, signal.SIGSTOP)

    def go_on(self) -> None:
        """Let it go on."""
        os.killpg(self.process.pid, signal.SIGCONT)

    def _cpu_s(self) -> float:
        words = Path(f"/proc/{self.process.pid}/stat").read_text("ascii").rpartition(")")[2].split()
        return (int(words[11]) + int(words[12])) / TICKS_PER_S


@contextmanager
def children(spec: DatasetSpec, jobs: list[tuple[int, ...]], threads: int) -> Iterator[list[Child]]:
    """Start a child for each tuple of image numbers, which may repeat; end them after the block.

    What is asked of a child should be more than is waited for: one that has ended has no clock.
    """
    settings = Settings()
    with ExitStack() as stack:
        started = []
        for indices in jobs:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hi5-bench-")))
            job = RenderJob.of(settings, spec, indices, folder / "out")
            job = replace(job, threads=threads)
            command = (sys.executable, "-m", settings.child_module)
            child = Child(RenderProcess(job, folder, command))
            stack.callback(child.process.close)
            started.append(child)
        yield started


def repeated_spec(count: int, asked: argparse.Namespace) -> DatasetSpec:
    """Return a spec in four places; asked: side, quality and seed of a command line."""
    return parse_spec(
        {
            "count": count,
            "seed": asked.seed,
            "image": {"width": asked.side, "height": asked.side},
            "attributes": {"environment": list(PLACES)},
            "render": {"quality": asked.quality},
        }
    )


def image_options(parser: argparse.ArgumentParser, seed: int) -> None:
    """Add the options that `repeated_spec` reads."""
    parser.add_argument("--side", type=int, default=640)
    parser.add_argument("--quality", default="standard")
    parser.add_argument("--seed", type=int, default=seed)
