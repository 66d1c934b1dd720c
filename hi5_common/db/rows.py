"""Rows to records and back: nothing outside this package ever sees a row."""

from dataclasses import asdict, replace
from typing import Any

from hi5_common.db.tables import ShardRow
from hi5_common.domain.records import (
    Gap,
    Publication,
    Redraw,
    Shard,
    ShardStatus,
    StoredObject,
    Tallies,
)


def shard(row: ShardRow) -> Shard:
    """Return the record of a row."""
    return Shard(
        id=row.id,
        dataset_id=row.dataset_id,
        number=row.number,
        start=row.start,
        stop=row.stop,
        status=ShardStatus(row.status),
        attempt=row.attempt,
        progress=row.progress,
        lease_owner=row.lease_owner,
        lease_until=row.lease_until,
        failure_reason=row.failure_reason,
        publication=None if row.publication is None else publication(row.publication),
    )


def publication(document: dict[str, Any]) -> Publication:
    """Read a publication from its JSON column; those of older versions know of no gaps."""
    return Publication(
        samples=StoredObject(**document["samples"]),
        labels=StoredObject(**document["labels"]),
        members=StoredObject(**document["members"]),
        image_count=document["image_count"],
        tallies=Tallies(**document["tallies"]),
        gaps=tuple(Gap(**gap) for gap in document.get("gaps", ())),
        redraws=tuple(Redraw(**redraw) for redraw in document.get("redraws", ())),
    )


def publication_document(value: Publication) -> dict[str, Any]:
    """Return what the JSON column keeps of a publication: all but its pairs.

    They are most of it, and only their sum over the dataset is ever read (deliveries.py).
    """
    document = asdict(replace(value, tallies=replace(value.tallies, pairs={})))
    return {**document, "gaps": list(document["gaps"]), "redraws": list(document["redraws"])}
