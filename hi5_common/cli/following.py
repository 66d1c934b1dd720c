"""Following a dataset until it is settled, with a live bar for a person."""

import time
from collections.abc import Iterator
from uuid import UUID

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hi5_common.cli import console
from hi5_common.cli.client import DatasetLine, Service
from hi5_common.cli.console import Json
from hi5_common.cli.failures import OutcomeError
from hi5_common.domain.errors import TransientError
from hi5_common.domain.records import DatasetStatus, ShardStatus

POLL_S = 0.5
PATIENCE_S = 30.0
QUIET_S = 10.0
"""How often a line is printed where no live bar can be drawn."""

SETTLED = (
    DatasetStatus.COMPLETE,
    DatasetStatus.COMPLETE_WITH_GAPS,
    DatasetStatus.FAILED,
    DatasetStatus.CANCELLED,
)
NAMED_GAPS = 10


class DatasetNotComplete(OutcomeError):
    """The dataset is settled without all of its images."""


def updates(service: Service, dataset_id: UUID) -> Iterator[DatasetLine]:
    """Yield how far a dataset is until it is settled; the settled state is the last.

    A service that is away for less than PATIENCE_S, say because it restarts, is waited for.
    """
    answered_s = time.monotonic()
    dataset = service.dataset(dataset_id)
    while True:
        yield dataset
        if dataset.status in SETTLED:
            return
        time.sleep(POLL_S)
        try:
            dataset = service.dataset(dataset_id)
            answered_s = time.monotonic()
        except TransientError:
            if time.monotonic() - answered_s > PATIENCE_S:
                raise


def follow(service: Service, dataset_id: UUID) -> DatasetLine:
    """Show progress, rate and time left until the dataset is settled; return its state."""
    if console.err.is_terminal:
        return _follow_with_bar(service, dataset_id)
    return _follow_with_lines(service, dataset_id)


def require_complete(service: Service, dataset: DatasetLine) -> None:
    """Raise DatasetNotComplete unless every image is there: with the gaps, or with the failed
    shards' reasons.
    """
    if dataset.status is DatasetStatus.COMPLETE:
        return
    if dataset.status is DatasetStatus.COMPLETE_WITH_GAPS:
        raise DatasetNotComplete(_gaps_in_words(service, dataset))
    reasons = {
        shard.failure_reason or "unknown"
        for shard in service.shards(dataset.id)
        if shard.status is ShardStatus.FAILED
    }
    why = f" Failed shards say: {', '.join(sorted(reasons))}." if reasons else ""
    remedy = f" Try again with `hi5 retry {dataset.id}`." if reasons else ""
    done, count = dataset.progress.done, dataset.progress.count
    raise DatasetNotComplete(
        f"Dataset {dataset.id} is {dataset.status}: {done} of {count} images.{why}{remedy}"
    )


def _gaps_in_words(service: Service, dataset: DatasetLine) -> str:
    gaps = [gap for shard in service.shards(dataset.id) for gap in shard.gaps]
    named = "; ".join(map(str, gaps[:NAMED_GAPS]))
    more = f"; and {len(gaps) - NAMED_GAPS} more" if len(gaps) > NAMED_GAPS else ""
    return (
        f"Dataset {dataset.id} is complete but for {len(gaps)} of {dataset.progress.count} images "
        f"that could not be made: {named}{more}. `hi5 manifest {dataset.id} --json` names them all."
    )


def progress_json(dataset: DatasetLine) -> dict[str, Json]:
    """Return the progress as plain data for scripts."""
    progress = dataset.progress.model_dump(mode="json")
    return {"id": str(dataset.id), "status": dataset.status.value, "progress": progress}


def _follow_with_bar(service: Service, dataset_id: UUID) -> DatasetLine:
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
        for dataset in updates(service, dataset_id):
            seen = _rendered(dataset)
            pace.observe(time.monotonic(), seen)
            bar.update(
                task,
                total=dataset.progress.count,
                completed=seen,
                status=state_in_words(dataset),
                pace=pace.words(dataset.progress.count),
            )
    return dataset


def _follow_with_lines(service: Service, dataset_id: UUID) -> DatasetLine:
    pace, next_line_s = Pace(time.monotonic()), 0.0
    for dataset in updates(service, dataset_id):
        now_s, seen, count = time.monotonic(), _rendered(dataset), dataset.progress.count
        pace.observe(now_s, seen)
        if now_s >= next_line_s or dataset.status in SETTLED:
            console.err.print(f"{state_in_words(dataset)} {seen}/{count} {pace.words(count)}")
            next_line_s = now_s + QUIET_S
    return dataset


def state_in_words(dataset: DatasetLine) -> str:
    """Return the state, and how many images could not be made."""
    missing = dataset.progress.missing
    return dataset.status.value + (f", {missing:,} missing" if missing else "")


def _rendered(dataset: DatasetLine) -> int:
    return dataset.progress.done + dataset.progress.in_progress


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
