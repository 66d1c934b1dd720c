"""The manifest: what a dataset consists of and how far it has come, as the API sends it.

A reader that follows it knows every published object by key, size and SHA-256. It is paged by
shard number: `next` is the address of the following page, or None on the last.
"""

from datetime import datetime
from typing import Literal
from uuid import UUID

from pydantic import Field

from hi5_common.domain import keys
from hi5_common.domain.records import (
    Dataset,
    DatasetStatus,
    Gap,
    Publication,
    Redraw,
    Shard,
    ShardStatus,
    Tallies,
    without_gaps,
)
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.strict import StrictModel

ObjectName = Literal["samples.tar", "labels.parquet", "members.json"]
OBJECT_NAMES: tuple[ObjectName, ...] = (keys.SAMPLES, keys.LABELS, keys.MEMBERS)
"""The files of a published shard, in the order of `ManifestShard.objects`."""


class ManifestObject(StrictModel):
    """A published object: its name in the shard, its key in the store, size, SHA-256 in hex.

    Readers make files of the name, so it is one of OBJECT_NAMES and nothing else.
    """

    name: ObjectName
    key: str
    size_bytes: int = Field(ge=0)
    sha256: str


class ManifestShard(StrictModel):
    """Images [start, stop). Objects and tallies (`attribute=value`: images) only once done.

    gaps: images of a done shard that it does not have; redrawn: images that are later draws.
    """

    number: int = Field(ge=0)
    start: int = Field(ge=0)
    stop: int = Field(ge=0)
    status: ShardStatus
    attempt: int
    progress: int
    failure_reason: str | None
    objects: tuple[ManifestObject, ...]
    tallies: dict[str, int]
    gaps: tuple[Gap, ...] = ()
    redrawn: tuple[Redraw, ...] = ()

    def images(self) -> list[int]:
        """Return the images of a done shard."""
        return without_gaps(self.start, self.stop, self.gaps)


class Progress(StrictModel):
    """Images by how far they are. `done` are published; `in_progress` lie on a worker.

    missing: gaps of the shards that are done. The manifest names them.
    """

    count: int
    done: int
    in_progress: int
    missing: int = 0
    shards: dict[ShardStatus, int]


class Manifest(StrictModel):
    """One page of a dataset's manifest; the tallies are those of the whole dataset."""

    dataset_id: UUID
    status: DatasetStatus
    created_at: datetime
    spec: DatasetSpec
    progress: Progress
    tallies: dict[str, int]
    shards: tuple[ManifestShard, ...]
    next: str | None


def progress_of(dataset: Dataset) -> Progress:
    """Return the progress of a dataset, with every status counted, zeros too."""
    return Progress(
        count=dataset.spec.count,
        done=dataset.images_done,
        in_progress=dataset.images_in_progress,
        missing=dataset.images_missing,
        shards={status: dataset.shards_by_status.get(status, 0) for status in ShardStatus},
    )


def manifest_head(dataset: Dataset, tallies: Tallies) -> Manifest:
    """Return the manifest of a dataset without its shards."""
    return Manifest(
        dataset_id=dataset.id,
        status=dataset.status,
        created_at=dataset.created_at,
        spec=dataset.spec,
        progress=progress_of(dataset),
        tallies=tallies.values,
        shards=(),
        next=None,
    )


def manifest_shard(shard: Shard) -> ManifestShard:
    """Return the manifest's view of a shard row."""
    publication = shard.publication
    return ManifestShard(
        number=shard.number,
        start=shard.start,
        stop=shard.stop,
        status=shard.status,
        attempt=shard.attempt,
        progress=shard.progress,
        failure_reason=shard.failure_reason,
        objects=manifest_objects(publication) if publication else (),
        tallies=dict(publication.tallies.values) if publication else {},
        gaps=publication.gaps if publication else (),
        redrawn=publication.redraws if publication else (),
    )


def manifest_objects(publication: Publication) -> tuple[ManifestObject, ...]:
    """Return the published objects by name, in the order of OBJECT_NAMES."""
    stored = (publication.samples, publication.labels, publication.members)
    return tuple(
        ManifestObject(name=name, key=item.key, size_bytes=item.size_bytes, sha256=item.sha256)
        for name, item in zip(OBJECT_NAMES, stored, strict=True)
    )
