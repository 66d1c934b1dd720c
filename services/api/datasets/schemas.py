"""A dataset as the API shows it."""

from datetime import datetime
from typing import Self
from uuid import UUID

from pydantic import BaseModel

from hi5_common.db.events import Event
from hi5_common.domain.manifest import Progress, progress_of
from hi5_common.domain.records import Dataset, DatasetStatus
from hi5_common.domain.spec import DatasetSpec
from services.api.paging import Limited


class DatasetPageQuery(Limited):
    """Newest first; `after` is the id of the last dataset of the page before."""

    after: UUID | None = None


class DatasetView(BaseModel):
    """A submitted spec and how far it has come."""

    id: UUID
    name: str
    status: DatasetStatus
    created_at: datetime
    cancel_requested_at: datetime | None
    progress: Progress
    spec: DatasetSpec
    links: dict[str, str]

    @classmethod
    def of(cls, dataset: Dataset) -> Self:
        """Show a record."""
        address = f"/v1/datasets/{dataset.id}"
        return cls(
            id=dataset.id,
            name=dataset.spec.name,
            status=dataset.status,
            created_at=dataset.created_at,
            cancel_requested_at=dataset.cancel_requested_at,
            progress=progress_of(dataset),
            spec=dataset.spec,
            links={
                "self": address,
                "manifest": f"{address}/manifest",
                "balance": f"{address}/balance",
                "audit": f"{address}/audit",
                "events": f"{address}/events",
                "failures": f"{address}/failures",
                "card": f"{address}/card",
                "croissant": f"{address}/croissant",
                "licences": f"{address}/licences",
                "page": f"/datasets/{dataset.id}",
                "audit_page": f"/datasets/{dataset.id}/audit",
            },
        )


class DatasetPage(BaseModel):
    """Some datasets, and the address of the next ones."""

    items: list[DatasetView]
    next: str | None


class RetriedView(BaseModel):
    """The dataset after a retry, and how many failed shards are pending again."""

    retried_shards: int
    dataset: DatasetView


class EventView(BaseModel):
    """Something that happened to a dataset or to one of its shards."""

    at: datetime
    kind: str
    shard_number: int | None
    attempt: int | None
    owner: str | None
    detail: str | None

    @classmethod
    def of(cls, event: Event) -> Self:
        """Show a record."""
        return cls(
            at=event.at,
            kind=event.kind,
            shard_number=event.shard_number,
            attempt=event.attempt,
            owner=event.owner,
            detail=event.detail,
        )


class EventPage(BaseModel):
    """The newest events first."""

    items: list[EventView]
