"""GET what failed of a dataset."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import Field

from hi5_common.domain.failure_report import FailurePage
from services.api.access.doors import Reading
from services.api.contract import refused
from services.api.failures import service
from services.api.paging import Limited, next_address

router = APIRouter(prefix="/v1/datasets", tags=["failures"])


class FailurePageQuery(Limited):
    """Newest first; `after` is the id of the last failure of the page before."""

    after: int | None = Field(None, ge=0, lt=2**63)


@router.get("/{dataset_id}/failures", responses=refused(404))
def list_failures(
    access: Reading, dataset_id: UUID, query: Annotated[FailurePageQuery, Query()]
) -> FailurePage:
    """List failed attempts, gaps and redraws, the newest first: why, where, and of which scene.

    The newest thousand of a dataset are kept.
    """
    found = service.newest(access, dataset_id, query.limit + 1, query.after)
    items = found[: query.limit]
    last = items[-1].failure.id if items else None
    address = f"/v1/datasets/{dataset_id}/failures"
    following = next_address(address, query.limit, last, full=len(found) > query.limit)
    return FailurePage(items=items, next=following)
