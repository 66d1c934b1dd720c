"""The published files of one shard."""

import functools
from collections.abc import Iterator
from uuid import UUID

from hi5_common.db.errors import ShardNotFound
from hi5_common.domain import keys
from hi5_common.domain.errors import Problem
from hi5_common.domain.manifest import ManifestObject, manifest_objects
from hi5_common.settings import Settings
from hi5_common.storage.open import open_signed_reads
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.s3 import SignedReads
from services.api.access.access import Access
from services.api.images.service import published
from services.api.objects.ranges import ByteRange
from services.api.problems import ApiError

PIECE_BYTES = 4 << 20
MEDIA_TYPES = {
    keys.SAMPLES: "application/x-tar",
    keys.LABELS: "application/vnd.apache.parquet",
    keys.MEMBERS: "application/json",
}


def find_object(access: Access, dataset_id: UUID, number: int, name: str) -> ManifestObject:
    """Return a published object. Raises DatasetNotFound, or ApiError 404 that says why not."""
    if name not in MEDIA_TYPES:
        remedy = f"A shard has {', '.join(MEDIA_TYPES)}."
        raise ApiError(404, "not-found", "No such object", [Problem("name", name, remedy)])
    with access.snapshot() as mine:
        try:
            shard = mine.shard(dataset_id, number)
        except ShardNotFound as error:
            remedy = "The dataset's /manifest lists its shards."
            problem = Problem("number", number, remedy)
            raise ApiError(404, "not-found", "No such shard", [problem]) from error
    objects = manifest_objects(published(shard, Problem("number", number, "")))
    return next(item for item in objects if item.name == name)


@functools.lru_cache(maxsize=2)
def signed_reads(settings: Settings) -> SignedReads | None:
    """Return what signs addresses of the store, or None if clients cannot reach it."""
    return open_signed_reads(settings)


def read_range(store: ObjectStore, key: str, wanted: ByteRange) -> Iterator[bytes]:
    """Yield bytes [start, stop) of an object in pieces."""
    for start in range(wanted.start, wanted.stop, PIECE_BYTES):
        yield store.get_range(key, start, min(start + PIECE_BYTES, wanted.stop))
