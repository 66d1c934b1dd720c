"""One page of a manifest, read in one snapshot."""

from uuid import UUID

from hi5_common.domain.manifest import Manifest, manifest_head, manifest_shard
from services.api.access.access import Access
from services.api.paging import next_address


def manifest(access: Access, dataset_id: UUID, limit: int, after: int | None) -> Manifest:
    """Return the shards after number `after`. Raises DatasetNotFound."""
    with access.snapshot() as mine:
        dataset = mine.get(dataset_id)
        found = mine.shards(dataset_id, limit + 1, after)
        tallies = mine.delivered(dataset_id)
    page = found[:limit]
    path = f"/v1/datasets/{dataset_id}/manifest"
    last = page[-1].number if page else None
    return manifest_head(dataset, tallies).model_copy(
        update={
            "shards": tuple(manifest_shard(shard) for shard in page),
            "next": next_address(path, limit, last, full=len(found) > limit),
        }
    )
