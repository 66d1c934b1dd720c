"""What can be done with a dataset. Each function is one transaction, committed when it returns."""

from dataclasses import dataclass
from uuid import UUID

from hi5_common.db import datasets, events, shards
from hi5_common.db.events import Event
from hi5_common.domain.errors import Problem
from hi5_common.domain.records import Dataset, DatasetStatus
from hi5_common.domain.spec import DatasetSpec
from services.api.cards.places import require_tradable
from services.api.parts import Parts
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


def submit(parts: Parts, spec: DatasetSpec, idempotency_key: str | None) -> Submitted:
    """Store a spec and its shards. Raises InvalidInput, IdempotencyConflict."""
    require_tradable(parts, spec)
    plan = parts.plans.of(spec)
    with parts.database.transaction() as session:
        made = datasets.create(session, spec, plan, idempotency_key=idempotency_key)
        settings = parts.settings
        due = shards.pending_to_ring(session, settings.max_rings, settings.ring_s)
    return Submitted(made.dataset, made.created, due)


def page(parts: Parts, limit: int, after: UUID | None) -> list[Dataset]:
    """Return datasets, the newest first."""
    with parts.database.snapshot() as session:
        return datasets.page(session, limit, after)


def get(parts: Parts, dataset_id: UUID) -> Dataset:
    """Return one dataset. Raises DatasetNotFound."""
    with parts.database.snapshot() as session:
        return datasets.get(session, dataset_id)


def cancel(parts: Parts, dataset_id: UUID) -> Dataset:
    """Ask for no more images. Idempotent; raises DatasetNotFound, ApiError 409 when complete."""
    with parts.database.transaction() as session:
        dataset = datasets.get(session, dataset_id)
        for status in (DatasetStatus.COMPLETE, DatasetStatus.COMPLETE_WITH_GAPS):
            _refuse_if(dataset, status, "is complete")
        return datasets.request_cancel(session, dataset_id)


def retry(parts: Parts, dataset_id: UUID) -> Retried:
    """Make failed shards pending again.

    Raises DatasetNotFound, ApiError 409 when cancelled or complete but for gaps.
    """
    with parts.database.transaction() as session:
        dataset = datasets.get(session, dataset_id)
        _refuse_if(dataset, DatasetStatus.CANCELLED, "was cancelled")
        with_gaps = "is complete but for its gaps, which are not drawn again"
        _refuse_if(dataset, DatasetStatus.COMPLETE_WITH_GAPS, with_gaps)
        count = datasets.retry_failed(session, dataset_id)
        session.expire_all()
        dataset = datasets.get(session, dataset_id)
        settings = parts.settings
        due = shards.pending_to_ring(session, settings.max_rings, settings.ring_s)
    return Retried(dataset, count, due)


def delete(parts: Parts, dataset_id: UUID) -> None:
    """Forget a dataset; its objects are swept later. Raises DatasetNotFound."""
    with parts.database.transaction() as session:
        datasets.delete(session, dataset_id)


def latest_events(parts: Parts, dataset_id: UUID, limit: int) -> list[Event]:
    """Return what happened, the newest first. Raises DatasetNotFound."""
    with parts.database.snapshot() as session:
        datasets.spec(session, dataset_id)
        return events.of_latest(session, dataset_id, limit)


def _refuse_if(dataset: Dataset, status: DatasetStatus, how: str) -> None:
    if dataset.status is not status:
        return
    remedy = f"The dataset {how}: nothing is left to do. Submit the spec again for a new one."
    problem = Problem("status", str(dataset.status), remedy)
    raise ApiError(409, "conflict", "Not possible in this state", [problem])
