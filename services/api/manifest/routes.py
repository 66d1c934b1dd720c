"""GET what a dataset consists of."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import Field

from hi5_common.domain.manifest import Manifest
from services.api.access.doors import Reading
from services.api.contract import refused
from services.api.manifest import service
from services.api.paging import Limited

router = APIRouter(prefix="/v1/datasets", tags=["manifest"])


class ManifestQuery(Limited):
    """`after` is the number of the last shard of the page before."""

    after: int | None = Field(None, ge=0, le=2**31 - 1)


@router.get("/{dataset_id}/manifest", responses=refused(404))
def get_manifest(
    access: Reading, dataset_id: UUID, query: Annotated[ManifestQuery, Query()]
) -> Manifest:
    """Return progress, totals and shards with their objects' keys, sizes and SHA-256."""
    return service.manifest(access, dataset_id, query.limit, query.after)
