"""Rendering the images of a shard through as many child processes as it takes."""

import hashlib
import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

from hi5_common.domain.faults import OF_THE_MACHINE, ImageFault
from hi5_common.domain.records import Gap, Redraw
from hi5_common.domain.retry import FailureKind
from hi5_common.settings import Settings
from services.worker.fleet import child_events
from services.worker.fleet.attempt_errors import AttemptFailed, DrainRequested
from services.worker.fleet.child_events import (
    AllDone,
    ChildBroken,
    ImageRefused,
    ImageRendered,
    Ready,
)
from services.worker.fleet.child_memory import MemoryTrend
from services.worker.fleet.child_records import ChildEnd, ChildRecord, Ended, log_end
from services.worker.fleet.render_process import ChildGone, RenderJob, RenderProcess

log = logging.getLogger(__name__)

TRIES_PER_IMAGE = 3
"""Of the first draw of an image's cell. A later draw has one."""
DRAWS = 3
"""After so many draws of its cell an image is a gap."""
TICK_S = 0.1
"""How often, at least, a child's memory is looked at and the attempt's end asked for."""


@dataclass(frozen=True)
class Limits:
    """When to give up on a child: seconds without progress, images made, megabytes grown.

    Beyond memory_mb a child is replaced after its image; beyond memory_limit_mb it is killed.
    """

    image_timeout_s: float
    images: int
    memory_mb: int
    memory_limit_mb: int
    drain_s: float

    @classmethod
    def of(cls, settings: Settings) -> Self:
        """Return the limits of the settings."""
        return cls(
            settings.image_timeout_s,
            settings.child_images,
            settings.child_memory_mb,
            settings.child_memory_limit_mb,
            settings.drain_s,
        )


@dataclass(frozen=True)
class RenderedImage:
    """The verified files of one image in the output folder."""

    index: int
    image_path: Path
    label_path: Path
    image_sha256: str
    label_sha256: str


@dataclass
class ShardRender:
    """The state of rendering one shard: what is done, and what went wrong where.

    check is called several times a second; it raises to end the attempt (lease lost, cancelled).
    draining says whether the worker is told to stop. ended is told of each child that has.
    """

    job: RenderJob
    folder: Path
    extension: str
    command: Sequence[str]
    limits: Limits
    check: Callable[[int], None]
    draining: Callable[[], bool]
    ended: Callable[[ChildRecord], None] = log_end
    done: dict[int, RenderedImage] = field(default_factory=dict)
    tries: dict[int, int] = field(default_factory=dict)
    draws: dict[int, Redraw] = field(default_factory=dict)
    gaps: dict[int, Gap] = field(default_factory=dict)
    failed_starts: int = 0
    seconds_spent: float = 0.0
    drain_since_s: float | None = None

    def run(self) -> list[RenderedImage]:
        """Render every image of the job; return them in order of their index.

        A crash or a hang costs the image in flight. An image that failed TRIES_PER_IMAGE times is
        replaced by the next draw of its cell (`draws`), and is a gap when DRAWS have failed
        (`gaps`). Raises AttemptFailed when every image is a gap, when TRIES_PER_IMAGE images failed
        and none succeeded, or when that many children would not even start.
        """
        while remaining := self._remaining():
            self._run_child(remaining)
        if not self.done and self.gaps:
            first = self.gaps[min(self.gaps)]
            raise AttemptFailed(FailureKind.IMAGE, f"image {first.index}: {first.reason}")
        return [self.done[index] for index in sorted(self.done)]

    def _remaining(self) -> tuple[int, ...]:
        # What failed comes last: its last try is then alone in a fresh child.
        settled = self.done.keys() | self.gaps.keys()
        left = (index for index in self.job.indices if index not in settled)
        return tuple(sorted(left, key=lambda index: self.tries.get(index, 0)))

    def _run_child(self, indices: tuple[int, ...]) -> None:
        draws = {index: self.draws[index].draw for index in indices if index in self.draws}
        job = replace(self.job, indices=indices, draws=draws)
        child = RenderProcess(job, self.folder, self.command)
        log.info("render child started", extra={"action": "child_start", "pid": child.pid})
        watch = _Supervision(self, child, list(indices))
        try:
            watch.watch()
        finally:
            child.close()
            self.ended(watch.record())

    def accept(self, event: ImageRendered) -> None:
        """Count an image as done if its files are what the child says they are."""
        stem = f"{event.index:09d}"
        out_dir = Path(self.job.out_dir)
        image = RenderedImage(
            event.index,
            out_dir / f"{stem}.{self.extension}",
            out_dir / f"{stem}.json",
            event.image_sha256,
            event.label_sha256,
        )
        self.seconds_spent += event.seconds
        if _matches(image.image_path, image.image_sha256) and _matches(
            image.label_path, image.label_sha256
        ):
            self.done[event.index] = image
        else:
            self.blame(event.index, ImageFault.WRONG_FILES, "not those that the child reported")

    def blame(self, index: int, fault: ImageFault, detail: str) -> None:
        """Count a try of an image that came to nothing; after the last one draw it again.

        The next child is told of the draw: this one goes on with what it has. Raises
        AttemptFailed for a fault of the machine: no other draw would mend it.
        """
        self.tries[index] = self.tries.get(index, 0) + 1
        number = {"index": index, "try": self.tries[index]}
        log.warning(
            "image failed: %s: %s",
            fault.value,
            detail,
            extra={"action": "image_failed", "fault": fault.value, **number},
        )
        if fault in OF_THE_MACHINE:
            raise _machine_failed(fault, f"image {index}: {detail}")
        draw = self.draws[index].draw if index in self.draws else 0
        if draw > 0 or self.tries[index] >= TRIES_PER_IMAGE:
            self._replace(index, draw + 1, fault, detail)
        if not self.done and len(self.tries) >= TRIES_PER_IMAGE:
            images = f"images {sorted(self.tries)} failed here and none succeeded"
            raise AttemptFailed(FailureKind.WORKER, f"{fault.value}: {images}; {detail}")

    def _replace(self, index: int, draw: int, fault: ImageFault, detail: str) -> None:
        """Give an image its next draw, or give it up."""
        told = f"{fault.value}: failed {self.tries[index]} times; {detail}"
        if draw >= DRAWS:
            self.gaps[index] = Gap(index, told)
            self.draws.pop(index, None)
        else:
            self.draws[index] = Redraw(index, draw, told)
        action = "image_given_up" if index in self.gaps else "image_redrawn"
        log.warning("image replaced", extra={"action": action, "index": index, "draw": draw})

    def blame_start(self, fault: ImageFault, detail: str) -> None:
        """Count a child that ended before it was ready."""
        self.failed_starts += 1
        message = f"the render child will not start; {detail}"
        log.warning(message, extra={"action": "child_start_failed", "fault": fault.value})
        if fault in OF_THE_MACHINE:
            raise _machine_failed(fault, message)
        if self.failed_starts >= TRIES_PER_IMAGE:
            raise AttemptFailed(FailureKind.CHILD_START, f"{fault.value}: {message}")

    def heed(self) -> None:
        """Raise if the attempt has to end now."""
        self.check(len(self.done))
        if not self.draining() or not self._remaining():
            return
        now_s = time.monotonic()
        self.drain_since_s = now_s if self.drain_since_s is None else self.drain_since_s
        left_s = self.limits.drain_s - (now_s - self.drain_since_s)
        if self._needed_s() > left_s:
            raise DrainRequested

    def _needed_s(self) -> float:
        if not self.done:
            return float("inf")
        return len(self._remaining()) * self.seconds_spent / len(self.done)


@dataclass
class _Supervision:
    """Watching over one child until it ends, hangs, or has grown too old."""

    shard: ShardRender
    child: RenderProcess
    waiting: list[int]
    ready: bool = False
    images: int = 0
    network: str = "unknown"
    trend: MemoryTrend = field(default_factory=MemoryTrend)
    broken: ChildBroken | None = None
    end: ChildEnd = Ended.ABANDONED

    def watch(self) -> None:
        """Return once it has ended, or is to be ended."""
        deadline_s = self._deadline_s()
        finished = False
        while not finished:
            self.shard.heed()
            try:
                event = self.child.next_event(TICK_S)
            except ChildGone:
                return self._gone()
            except child_events.ProtocolError as error:
                return self._failed(ImageFault.BROKEN_PROTOCOL, str(error))
            if event is not None:
                deadline_s = self._deadline_s()
                finished = self._handle(event)
            elif time.monotonic() > deadline_s:
                limit_s = self.shard.limits.image_timeout_s
                return self._failed(ImageFault.HANG, f"no progress for {limit_s:g} s")
            if not finished and (held_mb := self.child.memory_mb()) > self._most_mb():
                told = f"{held_mb:.0f} MB held, child_memory_limit_mb is {self._most_mb()}"
                return self._failed(ImageFault.OUT_OF_MEMORY, told)
        return None

    def record(self) -> ChildRecord:
        """Return what is to be known of the child."""
        trend = self.trend
        return ChildRecord(
            self.child.pid, self.end, self.images, trend.peak_mb, trend.slope_mb, self.network
        )

    def _deadline_s(self) -> float:
        return time.monotonic() + self.shard.limits.image_timeout_s

    def _most_mb(self) -> int:
        return self.shard.limits.memory_limit_mb

    def _handle(self, event: child_events.ChildEvent) -> bool:
        """Take in an event; return True when this child is finished with."""
        match event:
            case Ready():
                self.ready, self.network = True, event.network
            case ImageRendered():
                self._take(event.index)
                self.shard.accept(event)
                return self._finished_with(event)
            case ImageRefused():
                self._take(event.index)
                # Out of memory, who knows what else of the child got none.
                finished = event.fault is ImageFault.OUT_OF_MEMORY
                if finished or event.fault in OF_THE_MACHINE:
                    self.end = event.fault
                self.shard.blame(event.index, event.fault, event.detail)
                return finished
            case ChildBroken():
                self.broken = event
            case AllDone():
                self.end = Ended.DONE
                for index in self.waiting:
                    self.shard.blame(index, ImageFault.BROKEN_PROTOCOL, "the child forgot it")
                return True
        return False

    def _take(self, index: int) -> None:
        if index in self.waiting:
            self.waiting.remove(index)

    def _finished_with(self, event: ImageRendered) -> bool:
        self.images += 1
        self.trend.after_image_mb.append(event.rss_mb)
        limits = self.shard.limits
        worn_out = event.rss_mb > limits.memory_mb or self.images >= limits.images
        # Without work left there is nothing to wait for: an exit may hang or crash.
        if worn_out or not self.waiting:
            self.end = Ended.WORN_OUT if self.waiting else Ended.DONE
            return True
        return False

    def _gone(self) -> None:
        how = self.child.describe_end()
        if self.broken is not None:
            self._failed(self.broken.fault, f"{self.broken.detail}; {how}")
        else:
            self._failed(self.child.fault_of_end(), how)

    def _failed(self, fault: ImageFault, how: str) -> None:
        self.end = fault
        if self.ready and self.waiting:
            self.shard.blame(self.waiting[0], fault, how)
        elif self.waiting:
            self.shard.blame_start(fault, how)


def _machine_failed(fault: ImageFault, message: str) -> AttemptFailed:
    if fault is ImageFault.DISK_FULL:
        return AttemptFailed(FailureKind.DISK_FULL, message)
    return AttemptFailed(FailureKind.WORKER, f"{fault.value}: {message}")


def _matches(path: Path, sha256: str) -> bool:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest() == sha256
    except OSError:
        return False
