"""Following a dataset until it is settled, with a live bar for a person."""

import time
from collections.abc import Iterator
from uuid import UUID

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hi5_common.cli import console
from hi5_common.cli.client import Service
from hi5_common.cli.console import Json
from hi5_common.cli.failures import OutcomeError
from hi5_common.domain.manifest import Manifest
from hi5_common.domain.records import DatasetStatus, ShardStatus

POLL_S = 0.5
QUIET_S = 10.0
"""How often a line is printed where no live bar can be drawn."""

SETTLED = (DatasetStatus.COMPLETE, DatasetStatus.FAILED, DatasetStatus.CANCELLED)


class DatasetNotComplete(OutcomeError):
    """The dataset is settled without all of its images."""


def updates(service: Service, dataset_id: UUID) -> Iterator[Manifest]:
    """Yield the manifest's first page until the dataset is settled; the settled one is the last."""
    while True:
        manifest = service.manifest(dataset_id)
        yield manifest
        if manifest.status in SETTLED:
            return
        time.sleep(POLL_S)


def follow(service: Service, dataset_id: UUID) -> Manifest:
    """Show progress, rate and time left until the dataset is settled; return its manifest."""
    if console.err.is_terminal:
        return _follow_with_bar(service, dataset_id)
    return _follow_with_lines(service, dataset_id)


def require_complete(service: Service, manifest: Manifest) -> None:
    """Raise DatasetNotComplete with the failed shards' reasons unless every image is there."""
    if manifest.status is DatasetStatus.COMPLETE:
        return
    reasons = {
        shard.failure_reason or "unknown"
        for shard in service.shards(manifest.dataset_id)
        if shard.status is ShardStatus.FAILED
    }
    why = f" Failed shards say: {', '.join(sorted(reasons))}." if reasons else ""
    remedy = f" Try again with `hi5 retry {manifest.dataset_id}`." if reasons else ""
    done, count = manifest.progress.done, manifest.progress.count
    raise DatasetNotComplete(
        f"Dataset {manifest.dataset_id} is {manifest.status}: "
        f"{done} of {count} images.{why}{remedy}"
    )


def progress_json(manifest: Manifest) -> dict[str, Json]:
    """Return the progress as plain data for scripts."""
    progress = manifest.progress.model_dump(mode="json")
    return {"id": str(manifest.dataset_id), "status": manifest.status.value, "progress": progress}


def _follow_with_bar(service: Service, dataset_id: UUID) -> Manifest:
    columns = (
        TextColumn("{task.fields[status]}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}"),
        TimeElapsedColumn(),
    )
    pace = Pace(time.monotonic())
    with Progress(*columns, console=console.err) as bar:
        task = bar.add_task("images", total=None, status="…", pace="")
        for manifest in updates(service, dataset_id):
            seen = _rendered(manifest)
            pace.observe(time.monotonic(), seen)
            bar.update(
                task,
                total=manifest.progress.count,
                completed=seen,
                status=manifest.status.value,
                pace=pace.words(manifest.progress.count),
            )
    return manifest


def _follow_with_lines(service: Service, dataset_id: UUID) -> Manifest:
    pace, next_line_s = Pace(time.monotonic()), 0.0
    for manifest in updates(service, dataset_id):
        now_s, seen, count = time.monotonic(), _rendered(manifest), manifest.progress.count
        pace.observe(now_s, seen)
        if now_s >= next_line_s or manifest.status in SETTLED:
            console.err.print(f"{manifest.status.value} {seen}/{count} {pace.words(count)}")
            next_line_s = now_s + QUIET_S
    return manifest


def _rendered(manifest: Manifest) -> int:
    return manifest.progress.done + manifest.progress.in_progress


class Pace:
    """Images a second since the first one came, and how long the rest will take."""

    def __init__(self, start_s: float) -> None:
        self._start_s = start_s
        self._start_images: int | None = None
        self._now_s, self._images = start_s, 0

    def observe(self, now_s: float, images: int) -> None:
        """Note how many images there are at a time. The clock starts with the first change."""
        if self._start_images is None or images <= self._start_images:
            self._start_s, self._start_images = now_s, images
        self._now_s, self._images = now_s, images

    @property
    def images_per_s(self) -> float:
        gained = self._images - (self._start_images or 0)
        return gained / max(self._now_s - self._start_s, 1e-9) if gained else 0.0

    def words(self, count: int) -> str:
        """Say rate and time left, or nothing while nothing is known."""
        if not self.images_per_s:
            return ""
        left_s = (count - self._images) / self.images_per_s
        return f"{self.images_per_s:.2f} images/s, {_clock(left_s)} left"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
