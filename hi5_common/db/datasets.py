"""Datasets: submit, look at, cancel, retry, delete."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol
from uuid import UUID, uuid5

from sqlalchemy import delete as delete_rows
from sqlalchemy import insert, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from hi5_common.db import clock, deliveries, errors, events, extending, planned, quotas, rows
from hi5_common.db.extending import TakenOver
from hi5_common.db.quotas import LOCAL_HOLDING, Holding
from hi5_common.db.tables import (
    DatasetRow,
    DeletedDatasetRow,
    DeliveryRow,
    EventRow,
    FailureRow,
    PlannedRow,
    ShardRow,
)
from hi5_common.domain import lifecycle
from hi5_common.domain.cost import cost_of
from hi5_common.domain.lifecycle import DatasetEvent, Transition
from hi5_common.domain.records import Dataset, Publication, ShardStatus, Tallies
from hi5_common.domain.sharding import ShardRange
from hi5_common.domain.spec import DatasetSpec


class ShardPlan(Protocol):
    """What a dataset needs to know of its plan."""

    def shards(self) -> Iterable[ShardRange]:
        """Return the ranges that cover every image once."""
        ...

    def tallies(self) -> Tallies:
        """Return what all images add up to."""
        ...

    def tallies_of_first(self, count: int) -> Tallies:
        """Return what the first images add up to."""
        ...


@dataclass(frozen=True)
class CreatedDataset:
    """A dataset, and whether this call made it."""

    dataset: Dataset
    created: bool


def create(
    session: Session,
    spec: DatasetSpec,
    plan: ShardPlan,
    *,
    holding: Holding = LOCAL_HOLDING,
    idempotency_key: str | None = None,
    now: datetime | None = None,
) -> CreatedDataset:
    """Insert a dataset and all its shards; `now` is the database's own time unless given.

    Shards of the owner's complete dataset of just the spec that this one extends are done from the
    first. The owner's same key with the same spec returns the dataset it made before. Raises
    IdempotencyConflict if the key belongs to another spec, QuotaExceeded.
    """
    quotas.take_turn(session, holding)
    earlier = _of_key(session, holding.owner, idempotency_key)
    if earlier is not None:
        return _same_again(session, earlier, spec, idempotency_key)
    quotas.require_room(session, holding, cost_of(spec))
    moment = now or session.scalars(select(clock.now())).one()
    dataset_id, cuts = _new_id(moment), tuple(plan.shards())
    taken = extending.taken_over(session, holding.owner, spec, plan, frozenset(cuts))
    stored_key = _stored_key(holding.owner, idempotency_key)
    try:
        with session.begin_nested():
            values = _dataset_values(dataset_id, spec, moment, taken)
            values |= {"owner": holding.owner, "idempotency_key": stored_key}
            session.execute(insert(DatasetRow).values(values))
    except IntegrityError:  # another request used the key between our look and our insert
        earlier = _of_key(session, holding.owner, idempotency_key)
        if earlier is None:
            raise
        return _same_again(session, earlier, spec, idempotency_key)
    _insert_shards(session, dataset_id, cuts, moment, taken)
    deliveries.begin(session, dataset_id, len(cuts), _begun(taken))
    planned.keep(session, dataset_id, plan.tallies())
    events.record_dataset(session, dataset_id, DatasetEvent.CREATE)
    if taken is not None:
        _record_take_over(session, dataset_id, taken)
    return CreatedDataset(get(session, dataset_id), created=True)


def get(session: Session, dataset_id: UUID) -> Dataset:
    """Return a dataset with its counts. Raises DatasetNotFound."""
    return _records(session, [_row(session, dataset_id)])[0]


def spec(session: Session, dataset_id: UUID) -> DatasetSpec:
    """Return only the spec of a dataset. Raises DatasetNotFound."""
    return DatasetSpec.model_validate_json(_row(session, dataset_id).spec)


def owner_of(session: Session, dataset_id: UUID) -> str:
    """Return whose a dataset is. Raises DatasetNotFound."""
    return _row(session, dataset_id).owner


def page(
    session: Session, limit: int, after_id: UUID | None = None, owner: str | None = None
) -> list[Dataset]:
    """Return the newest datasets first, an owner's or all; `after_id` is the last one of the page
    before.
    """
    query = select(DatasetRow)
    if owner is not None:
        query = query.where(DatasetRow.owner == owner)
    if after_id is not None:
        query = query.where(DatasetRow.id < after_id)
    found = session.scalars(query.order_by(DatasetRow.id.desc()).limit(limit))
    return _records(session, list(found))


def request_cancel(session: Session, dataset_id: UUID) -> Dataset:
    """Cancel pending shards now and leased ones as soon as their workers ask. Idempotent.

    Raises DatasetNotFound.
    """
    _row(session, dataset_id)
    asked = session.scalar(
        update(DatasetRow)
        .where(DatasetRow.id == dataset_id, DatasetRow.cancel_requested_at.is_(None))
        .values(cancel_requested_at=clock.now())
        .returning(DatasetRow.id)
    )
    if asked is not None:
        events.record_dataset(session, dataset_id, DatasetEvent.REQUEST_CANCEL)
    cancel_pending(session, dataset_id)
    session.expire_all()
    return get(session, dataset_id)


def cancel_pending(session: Session, dataset_id: UUID) -> int:
    """Move a dataset's pending shards to cancelled; return how many."""
    cancelled = list(
        session.scalars(
            update(ShardRow)
            .where(ShardRow.dataset_id == dataset_id, ShardRow.status == ShardStatus.PENDING.value)
            .values(
                status=lifecycle.target(Transition.CANCEL).value, changed_at=clock.now(), progress=0
            )
            .returning(ShardRow.id)
            .execution_options(synchronize_session=False)
        )
    )
    events.record_shards(session, cancelled, Transition.CANCEL)
    return len(cancelled)


def retry_failed(session: Session, dataset_id: UUID) -> int:
    """Make failed shards pending again with a clean count of failures; return how many.

    Raises DatasetNotFound.
    """
    _row(session, dataset_id)
    revived = list(
        session.scalars(
            update(ShardRow)
            .where(ShardRow.dataset_id == dataset_id, ShardRow.status == ShardStatus.FAILED.value)
            .values(
                status=lifecycle.target(Transition.REVIVE).value,
                failures=0,
                failure_reason=None,
                not_before=clock.now(),
                rung_at=None,
                changed_at=clock.now(),
            )
            .returning(ShardRow.id)
            .execution_options(synchronize_session=False)
        )
    )
    events.record_shards(session, revived, Transition.REVIVE)
    return len(revived)


def delete(session: Session, dataset_id: UUID) -> None:
    """Delete every row of a dataset; the keeper removes its objects later.

    A worker that still renders for it loses its lease. Raises DatasetNotFound, DatasetInUse.
    """
    _row(session, dataset_id)
    if extending.is_extended(session, dataset_id):
        raise errors.DatasetInUse(dataset_id)
    for table in (EventRow, FailureRow, ShardRow, DeliveryRow, PlannedRow):
        session.execute(
            delete_rows(table)
            .where(table.dataset_id == dataset_id)
            .execution_options(synchronize_session=False)
        )
    session.execute(delete_rows(DatasetRow).where(DatasetRow.id == dataset_id))
    session.execute(insert(DeletedDatasetRow).values(id=dataset_id, deleted_at=clock.now()))


def _new_id(moment: datetime) -> UUID:
    """Return a UUID of version 7: ids sort by their time of creation."""
    milliseconds = int(moment.timestamp() * 1000)
    noise = int.from_bytes(os.urandom(10), "big")
    value = (milliseconds << 80) | noise
    value = (value & ~(0xF << 76)) | (0x7 << 76)
    return UUID(int=(value & ~(0x3 << 62)) | (0x2 << 62))


def _row(session: Session, dataset_id: UUID) -> DatasetRow:
    row = session.get(DatasetRow, dataset_id)
    if row is None:
        raise errors.DatasetNotFound(dataset_id)
    return row


def _of_key(session: Session, owner: str, key: str | None) -> DatasetRow | None:
    if key is None:
        return None
    stored = _stored_key(owner, key)
    return session.scalar(select(DatasetRow).where(DatasetRow.idempotency_key == stored))


def _stored_key(owner: str, key: str | None) -> str | None:
    """Return a key under its owner's name, which has no slash."""
    return None if key is None else f"{owner}/{key}"


def _same_again(
    session: Session, row: DatasetRow, asked: DatasetSpec, key: str | None
) -> CreatedDataset:
    if row.spec != asked.canonical_json():
        raise errors.IdempotencyConflict(str(key))
    return CreatedDataset(_records(session, [row])[0], created=False)


def _dataset_values(
    dataset_id: UUID, asked: DatasetSpec, moment: datetime, taken: TakenOver | None
) -> dict[str, Any]:
    cost = cost_of(asked)
    return {
        "id": dataset_id,
        "spec": asked.canonical_json(),
        "image_count": asked.count,
        "pixels": cost.pixels,
        "samples": cost.samples,
        "created_at": moment,
        "extends_id": taken.base_id if taken else None,
    }


def _insert_shards(
    session: Session,
    dataset_id: UUID,
    cuts: Sequence[ShardRange],
    moment: datetime,
    taken: TakenOver | None,
) -> None:
    published = taken.publications if taken else {}
    batch = [
        {
            "id": uuid5(dataset_id, str(cut.number)),
            "dataset_id": dataset_id,
            "number": cut.number,
            "start": cut.start,
            "stop": cut.stop,
            "status": (ShardStatus.DONE if cut in published else ShardStatus.PENDING).value,
            "attempt": 0,
            "failures": 0,
            "progress": cut.stop - cut.start if cut in published else 0,
            "publication": _document(published.get(cut)),
            "not_before": moment,
            "changed_at": moment,
        }
        for cut in cuts
    ]
    session.execute(insert(ShardRow), batch)


def _document(publication: Publication | None) -> dict[str, Any] | None:
    return None if publication is None else rows.publication_document(publication)


def _begun(taken: TakenOver | None) -> deliveries.Begun:
    if taken is None:
        return deliveries.NOTHING
    return deliveries.Begun(len(taken.publications), taken.images, taken.tallies)


def _record_take_over(session: Session, dataset_id: UUID, taken: TakenOver) -> None:
    events.record_dataset(session, dataset_id, DatasetEvent.TAKE_OVER, str(taken.base_id))
    for cut, publication in taken.publications.items():
        trouble = publication.trouble()
        if trouble is not None:
            events.record_dataset(
                session, dataset_id, DatasetEvent.TAKE_OVER, trouble, shard_number=cut.number
            )


def _records(session: Session, found: Sequence[DatasetRow]) -> list[Dataset]:
    counts = deliveries.counts(session, [row.id for row in found])
    return [_record(row, counts[row.id]) for row in found]


def _record(row: DatasetRow, count: deliveries.Count) -> Dataset:
    return Dataset(
        id=row.id,
        spec=DatasetSpec.model_validate_json(row.spec),
        created_at=row.created_at,
        cancel_requested_at=row.cancel_requested_at,
        status=lifecycle.dataset_status(
            count.shards,
            cancel_requested=row.cancel_requested_at is not None,
            images_missing=count.images_missing > 0,
        ),
        shards_by_status=count.shards,
        images_done=count.images_done,
        images_missing=count.images_missing,
        images_in_progress=count.images_in_progress,
    )
