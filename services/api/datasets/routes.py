"""Submit datasets, look at them, cancel, retry, delete."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, BackgroundTasks, Header, Query, Response

from services.api.access.doors import Reading, Writing
from services.api.contract import refused
from services.api.datasets import service
from services.api.datasets.schemas import (
    DatasetPage,
    DatasetPageQuery,
    DatasetView,
    EventPage,
    EventView,
    RetriedView,
)
from services.api.paging import Limited, next_address
from services.api.spec_body import OPENAPI_BODY, SpecBody

router = APIRouter(prefix="/v1/datasets", tags=["datasets"])

IdempotencyKey = Annotated[
    str | None,
    Header(alias="Idempotency-Key", min_length=1, max_length=200, pattern=r"^[ -~]+$"),
]


@router.post(
    "",
    status_code=201,
    openapi_extra=OPENAPI_BODY,
    responses={200: {"model": DatasetView}, **refused(409, 415)},
)
def submit_dataset(
    access: Writing,
    spec: SpecBody,
    background: BackgroundTasks,
    response: Response,
    idempotency_key: IdempotencyKey = None,
) -> DatasetView:
    """Store a spec and start work. The same Idempotency-Key and spec again give 200, no copy."""
    submitted = service.submit(access, spec, idempotency_key)
    background.add_task(access.parts.announce, submitted.due)
    response.status_code = 201 if submitted.created else 200
    response.headers["Location"] = f"/v1/datasets/{submitted.dataset.id}"
    return DatasetView.of(submitted.dataset)


@router.get("")
def list_datasets(access: Reading, query: Annotated[DatasetPageQuery, Query()]) -> DatasetPage:
    """List datasets, the newest first."""
    found = service.page(access, query.limit + 1, query.after)
    items = found[: query.limit]
    last = items[-1].id if items else None
    following = next_address("/v1/datasets", query.limit, last, full=len(found) > query.limit)
    return DatasetPage(items=[DatasetView.of(dataset) for dataset in items], next=following)


@router.get("/{dataset_id}", responses=refused(404))
def get_dataset(access: Reading, dataset_id: UUID) -> DatasetView:
    """Return one dataset and how far it has come."""
    return DatasetView.of(service.get(access, dataset_id))


@router.get("/{dataset_id}/events", responses=refused(404))
def list_events(access: Reading, dataset_id: UUID, query: Annotated[Limited, Query()]) -> EventPage:
    """List what happened to a dataset, the newest first."""
    found = service.latest_events(access, dataset_id, query.limit)
    return EventPage(items=[EventView.of(event) for event in found])


@router.post("/{dataset_id}/cancel", status_code=202, responses=refused(404, 409))
def cancel_dataset(access: Writing, dataset_id: UUID) -> DatasetView:
    """Stop: pending shards now, leased ones when their workers next ask. What is done stays."""
    return DatasetView.of(service.cancel(access, dataset_id))


@router.post("/{dataset_id}/retry", status_code=202, responses=refused(404, 409))
def retry_dataset(access: Writing, dataset_id: UUID, background: BackgroundTasks) -> RetriedView:
    """Give failed shards another chance."""
    retried = service.retry(access, dataset_id)
    background.add_task(access.parts.announce, retried.due)
    return RetriedView(retried_shards=retried.count, dataset=DatasetView.of(retried.dataset))


@router.delete(
    "/{dataset_id}",
    status_code=204,
    response_class=Response,
    responses=refused(404, 409),
)
def delete_dataset(access: Writing, dataset_id: UUID) -> Response:
    """Forget a dataset. Its objects are removed by the keeper a while later."""
    service.delete(access, dataset_id)
    return Response(status_code=204)
