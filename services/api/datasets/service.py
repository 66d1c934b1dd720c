"""What can be done with a dataset. Each function is one transaction, committed when it returns."""

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

from hi5_common.db.owned import Event
from hi5_common.domain.errors import Problem
from hi5_common.domain.records import Dataset, DatasetStatus
from hi5_common.domain.spec import DatasetSpec
from services.api.access.access import Access
from services.api.cards.places import require_tradable
from services.api.problems import ApiError


@dataclass(frozen=True)
class Submitted:
    """A dataset, whether it is new, and the shards to announce."""

    dataset: Dataset
    created: bool
    due: list[UUID]


@dataclass(frozen=True)
class Retried:
    """A dataset whose failed shards are pending again, and the shards to announce."""

    dataset: Dataset
    count: int
    due: list[UUID]


def submit(access: Access, spec: DatasetSpec, idempotency_key: str | None) -> Submitted:
    """Store a spec and its shards. Raises InvalidInput, IdempotencyConflict, QuotaExceeded."""
    parts = access.parts
    require_tradable(parts, spec)
    plan = parts.plans.of(spec)
    with access.transaction() as mine:
        made = mine.create(spec, plan, idempotency_key)
        settings = parts.settings
        due = mine.shards_to_ring(settings.max_rings, settings.ring_s)
    return Submitted(made.dataset, made.created, due)


def page(access: Access, limit: int, after: UUID | None) -> list[Dataset]:
    """Return datasets, the newest first."""
    with access.snapshot() as mine:
        return mine.page(limit, after)


def get(access: Access, dataset_id: UUID) -> Dataset:
    """Return one dataset. Raises DatasetNotFound."""
    with access.snapshot() as mine:
        return mine.get(dataset_id)


def cancel(access: Access, dataset_id: UUID) -> Dataset:
    """Ask for no more images. Idempotent; raises DatasetNotFound, ApiError 409 when complete."""
    with access.transaction() as mine:
        dataset = mine.get(dataset_id)
        for status in (DatasetStatus.COMPLETE, DatasetStatus.COMPLETE_WITH_GAPS):
            _refuse_if(dataset, status, "is complete")
        return mine.request_cancel(dataset_id)


def retry(access: Access, dataset_id: UUID) -> Retried:
    """Make failed shards pending again.

    Raises DatasetNotFound, ApiError 409 when cancelled or complete but for gaps.
    """
    with access.transaction() as mine:
        dataset = mine.get(dataset_id)
        _refuse_if(dataset, DatasetStatus.CANCELLED, "was cancelled")
        with_gaps = "is complete but for its gaps, which are not drawn again"
        _refuse_if(dataset, DatasetStatus.COMPLETE_WITH_GAPS, with_gaps)
        count = mine.retry_failed(dataset_id)
        dataset = mine.get(dataset_id)
        settings = access.parts.settings
        due = mine.shards_to_ring(settings.max_rings, settings.ring_s)
    return Retried(dataset, count, due)


def delete(access: Access, dataset_id: UUID) -> None:
    """Forget a dataset; its objects are swept later. Raises DatasetNotFound."""
    with access.transaction() as mine:
        mine.delete(dataset_id)


def latest_events(access: Access, dataset_id: UUID, limit: int) -> Sequence[Event]:
    """Return what happened, the newest first. Raises DatasetNotFound."""
    with access.snapshot() as mine:
        return mine.latest_events(dataset_id, limit)


def _refuse_if(dataset: Dataset, status: DatasetStatus, how: str) -> None:
    if dataset.status is not status:
        return
    remedy = f"The dataset {how}: nothing is left to do. Submit the spec again for a new one."
    problem = Problem("status", str(dataset.status), remedy)
    raise ApiError(409, "conflict", "Not possible in this state", [problem])
