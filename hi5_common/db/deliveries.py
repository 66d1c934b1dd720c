"""What each dataset has delivered: one row, added to by the transaction that publishes a shard.

So no read adds shards up. Whoever locks a delivery has locked its shards before, never after.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any
from uuid import UUID

from sqlalchemy import ColumnElement, case, func, insert, select, update
from sqlalchemy.orm import Session

from hi5_common.db import errors
from hi5_common.db.tables import DatasetRow, DeliveryRow, ShardRow
from hi5_common.domain import tallies as counting
from hi5_common.domain.records import Publication, ShardStatus, Tallies


@dataclass(frozen=True)
class Count:
    """How many shards of a dataset are in each state that occurs, and how many images.

    images_missing: gaps of the shards that are done.
    """

    shards: dict[ShardStatus, int]
    images_done: int
    images_missing: int
    images_in_progress: int


@dataclass(frozen=True)
class Begun:
    """What a dataset has from the first: shards and images, no gaps."""

    shards: int
    images: int
    tallies: Tallies


NOTHING = Begun(0, 0, counting.EMPTY)


def begin(session: Session, dataset_id: UUID, shard_count: int, begun: Begun) -> None:
    """Insert the delivery of a new dataset: what it has from the first."""
    session.execute(
        insert(DeliveryRow).values(
            dataset_id=dataset_id,
            shard_count=shard_count,
            shards_done=begun.shards,
            images_done=begun.images,
            images_missing=0,
            tallies=asdict(begun.tallies),
        )
    )


def add(session: Session, dataset_id: UUID, publication: Publication) -> None:
    """Add a publication, in the transaction that makes its shard done, and as its last act:
    the row is locked until the commit, and every worker of the dataset needs it.
    """
    mine = DeliveryRow.dataset_id == dataset_id
    before = session.scalars(select(DeliveryRow.tallies).where(mine).with_for_update()).one()
    after = counting.add(Tallies(**before), publication.tallies)
    session.execute(
        update(DeliveryRow)
        .where(mine)
        .values(
            shards_done=DeliveryRow.shards_done + 1,
            images_done=DeliveryRow.images_done + publication.image_count,
            images_missing=DeliveryRow.images_missing + len(publication.gaps),
            tallies=asdict(after),
        )
        .execution_options(synchronize_session=False)
    )


def tallies(session: Session, dataset_id: UUID) -> Tallies:
    """Return what the published shards of a dataset add up to. Raises DatasetNotFound."""
    document = session.scalar(
        select(DeliveryRow.tallies).where(DeliveryRow.dataset_id == dataset_id)
    )
    if document is None:
        raise errors.DatasetNotFound(dataset_id)
    return Tallies(**document)


def shards_done(session: Session, dataset_id: UUID) -> int:
    """Return how many shards are in the sum, which tells every state of it from the others.

    Raises DatasetNotFound.
    """
    found = session.scalar(
        select(DeliveryRow.shards_done).where(DeliveryRow.dataset_id == dataset_id)
    )
    if found is None:
        raise errors.DatasetNotFound(dataset_id)
    return found


def counts(session: Session, dataset_ids: Sequence[UUID]) -> dict[UUID, Count]:
    """Return the counts of datasets, all of one moment.

    Counted are only shards that are few: leased, failed, and pending ones of a cancelled dataset.
    The others are what is left: without a cancel request no shard is ever cancelled.
    """
    asked = DatasetRow.cancel_requested_at.is_not(None)
    found = session.execute(
        select(
            DeliveryRow.dataset_id,
            DeliveryRow.shard_count.label("total"),
            DeliveryRow.shards_done.label("done"),
            DeliveryRow.images_done,
            DeliveryRow.images_missing,
            _of_shards(func.count(), ShardStatus.LEASED).label("leased"),
            _of_shards(func.coalesce(func.sum(ShardRow.progress), 0), ShardStatus.LEASED).label(
                "in_progress"
            ),
            _of_shards(func.count(), ShardStatus.FAILED).label("failed"),
            case((asked, _of_shards(func.count(), ShardStatus.PENDING))).label("pending"),
        )
        .join(DatasetRow, DatasetRow.id == DeliveryRow.dataset_id)
        .where(DeliveryRow.dataset_id.in_(dataset_ids))
    )
    return {row["dataset_id"]: _count(row) for row in found.mappings()}


def _of_shards(what: ColumnElement[int], status: ShardStatus) -> ColumnElement[Any]:
    return (
        select(what)
        .where(ShardRow.dataset_id == DeliveryRow.dataset_id, ShardRow.status == status.value)
        .correlate(DeliveryRow)
        .scalar_subquery()
    )


def _count(row: Mapping[Any, Any]) -> Count:
    rest = row["total"] - row["done"] - row["leased"] - row["failed"]
    pending = rest if row["pending"] is None else row["pending"]
    shards = {
        ShardStatus.PENDING: pending,
        ShardStatus.LEASED: row["leased"],
        ShardStatus.DONE: row["done"],
        ShardStatus.FAILED: row["failed"],
        ShardStatus.CANCELLED: rest - pending,
    }
    return Count(
        shards={status: number for status, number in shards.items() if number},
        images_done=int(row["images_done"]),
        images_missing=int(row["images_missing"]),
        images_in_progress=int(row["in_progress"]),
    )
