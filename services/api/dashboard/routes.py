"""The pages people look at; every number on them is in the JSON API too."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

from hi5_common.db import workers
from hi5_common.domain.access import Scope
from hi5_common.domain.strict import MAX_COUNT
from hi5_common.domain.vocabulary import ALWAYS_BALANCED, SKELETON, Attribute
from hi5_common.domain.workers import Worker
from hi5_common.fairness.page import body
from services.api.access.doors import Visiting
from services.api.audit.routes import RETRY_AFTER_S, MaxImages
from services.api.audit.service import audited
from services.api.dashboard.charts import bar_chart, crossed, fixed, heat_table
from services.api.dashboard.gallery import gallery
from services.api.dashboard.pages import page
from services.api.dashboard.shards import shard_board
from services.api.datasets import service
from services.api.datasets.schemas import DatasetPageQuery, DatasetView
from services.api.failures.service import newest
from services.api.paging import StrictQuery

FAILURES_SHOWN = 12

router = APIRouter(include_in_schema=False)


class DatasetQuery(StrictQuery):
    """The first image to show, and the two attributes to cross."""

    from_: int = Field(0, alias="from", ge=0, lt=MAX_COUNT)
    a: Attribute = Attribute.SKIN_TONE
    b: Attribute = Attribute.GENDER


@router.get("/")
def show_datasets(
    access: Visiting, request: Request, query: Annotated[DatasetPageQuery, Query()]
) -> Response:
    """Show datasets with their progress, the newest first."""
    found = service.page(access, query.limit + 1, query.after)
    shown = [DatasetView.of(dataset) for dataset in found[: query.limit]]
    following = shown[-1].id if len(found) > query.limit else None
    machines: list[Worker] = []
    if access.caller.sees_all:
        with access.parts.database.snapshot() as session:
            machines = workers.all_of_them(session)
    return page(
        request,
        "datasets.html",
        datasets=shown,
        following=following,
        query=query,
        workers=machines,
    )


@router.get("/datasets/{dataset_id}")
def show_dataset(
    access: Visiting, request: Request, dataset_id: UUID, query: Annotated[DatasetQuery, Query()]
) -> Response:
    """Show one dataset: progress, shards, balance, pairs, pictures."""
    dataset = service.get(access, dataset_id)
    with access.snapshot() as mine:
        found = access.parts.balances.of(mine, dataset_id)
    among = crossed(found)
    return page(
        request,
        "dataset.html",
        dataset=DatasetView.of(dataset),
        may_change=access.caller.scope.includes(Scope.WRITE),
        board=shard_board(access, dataset_id),
        failures=newest(access, dataset_id, FAILURES_SHOWN),
        balance=found,
        charts=[bar_chart(table) for table in found.attributes if table.attributes[0] in among],
        fixed=fixed(found),
        heat=heat_table(found, query.a, query.b),
        gallery=gallery(access, dataset_id, access.parts.plans.of(dataset.spec), query.from_),
        query=query,
        attributes=among,
        more=[attribute for attribute in among if attribute not in ALWAYS_BALANCED],
        skeleton=SKELETON,
    )


@router.get("/datasets/{dataset_id}/audit")
def show_audit(
    access: Visiting, request: Request, dataset_id: UUID, max_images: MaxImages
) -> Response:
    """Show what delivered labels say of a dataset's balance, or that this is being counted."""
    found = audited(access, dataset_id, max_images)
    return page(
        request,
        "dataset_audit.html",
        dataset=DatasetView.of(found.dataset),
        audited=found,
        refresh_s=RETRY_AFTER_S,
        **({} if found.report is None else body(found.report, found.command)),
    )
