"""The append-only history: one row for every transition, in the same transaction."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from sqlalchemy import ColumnElement, insert, literal, select
from sqlalchemy.orm import Session

from hi5_common.db import clock
from hi5_common.db.tables import EventRow, ShardRow
from hi5_common.domain.lifecycle import DatasetEvent, Transition


@dataclass(frozen=True)
class Event:
    """Something that happened to a dataset, or to one of its shards."""

    at: datetime
    dataset_id: UUID
    shard_number: int | None
    attempt: int | None
    kind: str
    owner: str | None
    detail: str | None


def of_dataset(session: Session, dataset_id: UUID, limit: int, after: int = 0) -> list[Event]:
    """Return events in the order they happened."""
    rows = session.scalars(
        select(EventRow)
        .where(EventRow.dataset_id == dataset_id, EventRow.id > after)
        .order_by(EventRow.id)
        .limit(limit)
    )
    return [_event(row) for row in rows]


def of_latest(session: Session, dataset_id: UUID, limit: int) -> list[Event]:
    """Return the newest events first."""
    rows = session.scalars(
        select(EventRow)
        .where(EventRow.dataset_id == dataset_id)
        .order_by(EventRow.id.desc())
        .limit(limit)
    )
    return [_event(row) for row in rows]


def record_dataset(
    session: Session,
    dataset_id: UUID,
    kind: DatasetEvent,
    detail: str | None = None,
    *,
    shard_number: int | None = None,
) -> None:
    """Write what happened to a dataset, or by that to one of its shards."""
    session.execute(
        insert(EventRow).values(
            at=clock.now(),
            dataset_id=dataset_id,
            shard_number=shard_number,
            kind=kind.value,
            detail=detail,
        )
    )


def record_shards(
    session: Session,
    shard_ids: Sequence[UUID],
    kind: Transition,
    *,
    owner: str | None = None,
    detail: str | None = None,
) -> None:
    """Write what happened to shards, with the attempt their rows name now."""
    columns = ("at", "dataset_id", "shard_number", "attempt", "kind", "owner", "detail")
    for start in range(0, len(shard_ids), 500):  # SQLite bounds the variables of a statement
        chosen: ColumnElement[bool] = ShardRow.id.in_(shard_ids[start : start + 500])
        session.execute(
            insert(EventRow).from_select(
                columns,
                select(
                    clock.now(),
                    ShardRow.dataset_id,
                    ShardRow.number,
                    ShardRow.attempt,
                    literal(kind.value),
                    literal(owner),
                    literal(detail),
                ).where(chosen),
            )
        )


def _event(row: EventRow) -> Event:
    return Event(
        row.at,
        row.dataset_id,
        row.shard_number,
        row.attempt,
        row.kind,
        row.owner,
        row.detail,
    )
