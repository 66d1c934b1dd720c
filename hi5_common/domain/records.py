"""The rows of the service as frozen values: what the database returns and everybody else reads."""

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from uuid import UUID

from hi5_common.domain.spec import DatasetSpec


class ShardStatus(StrEnum):
    """Where a shard is. `lifecycle.py` holds the table of allowed transitions."""

    PENDING = "pending"
    LEASED = "leased"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


TO_COME = frozenset({ShardStatus.PENDING, ShardStatus.LEASED})
"""Of a shard whose images may still come without anybody asking again."""


class DatasetStatus(StrEnum):
    """Derived from the shards: never stored beside them."""

    PENDING = "pending"
    RUNNING = "running"
    COMPLETE = "complete"
    COMPLETE_WITH_GAPS = "complete_with_gaps"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True)
class StoredObject:
    """One object in the store, as published: key, size in bytes, SHA-256 in hex."""

    key: str
    size_bytes: int
    sha256: str


@dataclass(frozen=True)
class Tallies:
    """How many delivered images have each value, and each pair of values of two attributes.

    `values` maps "attribute=value" to a count; `pairs` maps "a=x&b=y" (attributes in planning
    order) to a count. Counts add up over shards.
    """

    values: dict[str, int]
    pairs: dict[str, int]


@dataclass(frozen=True)
class Gap:
    """An image that no draw of its cell could be made of: it is missing, and this is why."""

    index: int
    reason: str

    def __str__(self) -> str:
        """Say it in a line; `reason` may go on with a log."""
        return f"image {self.index} is missing: {_first_line(self.reason)}"


@dataclass(frozen=True)
class Redraw:
    """An image that is draw `draw` of its cell, since those before it could not be made."""

    index: int
    draw: int
    reason: str

    def __str__(self) -> str:
        """Say it in a line; `reason` may go on with a log."""
        return f"image {self.index} is draw {self.draw} of its cell: {_first_line(self.reason)}"


def _first_line(reason: str) -> str:
    return reason.split("; log:", maxsplit=1)[0].split("\n", maxsplit=1)[0]


def without_gaps(start: int, stop: int, gaps: Iterable[Gap]) -> list[int]:
    """Return the images of a published range [start, stop): all but its gaps."""
    missing = {gap.index for gap in gaps}
    return [index for index in range(start, stop) if index not in missing]


@dataclass(frozen=True)
class Publication:
    """What a finished attempt made of a shard: image_count images, the gaps missing.

    Once published only the dataset's sum has the pairs; a publication that is read has none.
    """

    samples: StoredObject
    labels: StoredObject
    members: StoredObject
    image_count: int
    tallies: Tallies
    gaps: tuple[Gap, ...] = ()
    redraws: tuple[Redraw, ...] = ()

    def trouble(self) -> str | None:
        """Return the gaps and redraws in words; None without any."""
        return "; ".join(map(str, (*self.gaps, *self.redraws))) or None


@dataclass(frozen=True)
class Shard:
    """A range of image indices [start, stop) and how far it has come."""

    id: UUID
    dataset_id: UUID
    number: int
    start: int
    stop: int
    status: ShardStatus
    attempt: int
    progress: int
    lease_owner: str | None
    lease_until: datetime | None
    failure_reason: str | None
    publication: Publication | None

    def images(self) -> list[int]:
        """Return the images that are published."""
        if self.publication is None:
            return []
        return without_gaps(self.start, self.stop, self.publication.gaps)


@dataclass(frozen=True)
class Dataset:
    """A submitted spec with its counts of images and shards by status.

    images_missing: gaps of the shards that are done.
    """

    id: UUID
    spec: DatasetSpec
    created_at: datetime
    cancel_requested_at: datetime | None
    status: DatasetStatus
    shards_by_status: dict[ShardStatus, int]
    images_done: int
    images_in_progress: int
    images_missing: int = 0
