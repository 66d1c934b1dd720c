"""What the keeper asks of the database: lost leases, cancelled leftovers, objects to remove."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from sqlalchemy import delete, or_, select, update
from sqlalchemy.orm import Session

from hi5_common.db import clock, datasets, shards
from hi5_common.db.tables import DatasetRow, DeletedDatasetRow, ShardRow
from hi5_common.domain.records import ShardStatus
from hi5_common.domain.retry import FailureKind

_ABANDONED = (ShardStatus.FAILED.value, ShardStatus.CANCELLED.value)


@dataclass(frozen=True)
class ExpiredLease:
    """A lease that ran out, and what became of the shard."""

    shard_id: UUID
    owner: str
    status: ShardStatus


@dataclass(frozen=True)
class AttemptsToSweep:
    """A shard of which attempts below `first_kept` can never be published any more."""

    shard_id: UUID
    dataset_id: UUID
    number: int
    first_kept: int
    changed_at: datetime


def sweep_expired(session: Session, limit: int = 100) -> list[ExpiredLease]:
    """Take back shards whose workers went silent, by the retry decision."""
    expired = session.scalars(
        select(ShardRow)
        .where(ShardRow.status == ShardStatus.LEASED.value, ShardRow.lease_until < clock.now())
        .order_by(ShardRow.lease_until)
        .limit(limit)
        .with_for_update(skip_locked=True)
    ).all()
    return [_take_back(session, row) for row in expired]


def settle_cancelled(session: Session) -> int:
    """Cancel shards that came back to pending while their dataset was being cancelled."""
    left_over = session.scalars(
        select(DatasetRow.id)
        .join(ShardRow, ShardRow.dataset_id == DatasetRow.id)
        .where(
            ShardRow.status == ShardStatus.PENDING.value,
            DatasetRow.cancel_requested_at.is_not(None),
        )
        .distinct()
    ).all()
    return sum(datasets.cancel_pending(session, dataset_id) for dataset_id in left_over)


def attempts_to_sweep(session: Session, grace_s: float, limit: int = 100) -> list[AttemptsToSweep]:
    """Return shards unchanged for grace_s seconds that may have objects nobody will ever read.

    An attempt can be published only while its number is the row's and the row is leased. So every
    lower attempt is dead for ever, and the row's own one too once the shard failed or was
    cancelled: what is returned here stays true, whatever happens next.
    """
    rows = session.scalars(
        select(ShardRow)
        .where(
            or_(
                ShardRow.attempt > 1,
                (ShardRow.status.in_(_ABANDONED)) & (ShardRow.attempt > 0),
            ),
            ShardRow.changed_at <= clock.now_plus(-grace_s),
            or_(ShardRow.swept_at.is_(None), ShardRow.swept_at < ShardRow.changed_at),
        )
        .limit(limit)
    )
    return [
        AttemptsToSweep(
            row.id,
            row.dataset_id,
            row.number,
            row.attempt + (1 if row.status in _ABANDONED else 0),
            row.changed_at,
        )
        for row in rows
    ]


def mark_swept(session: Session, swept: Sequence[AttemptsToSweep]) -> None:
    """Remember that these shards are swept, as they were when they were looked at."""
    for item in swept:
        session.execute(
            update(ShardRow)
            .where(ShardRow.id == item.shard_id, ShardRow.changed_at == item.changed_at)
            .values(swept_at=clock.now())
            .execution_options(synchronize_session=False)
        )


def deleted_datasets(session: Session) -> list[UUID]:
    """Return the deleted datasets whose objects may still be there."""
    return list(session.scalars(select(DeletedDatasetRow.id)))


def forget_deleted(session: Session, dataset_id: UUID, grace_s: float) -> None:
    """Forget a deleted dataset once no worker can still be writing for it."""
    session.execute(
        delete(DeletedDatasetRow).where(
            DeletedDatasetRow.id == dataset_id,
            DeletedDatasetRow.deleted_at <= clock.now_plus(-grace_s),
        )
    )


def _take_back(session: Session, row: ShardRow) -> ExpiredLease:
    owner = str(row.lease_owner)
    reason = f"worker {owner} went silent"
    status = shards.give_back(session, row, FailureKind.LEASE_EXPIRED, reason, owner=owner)
    return ExpiredLease(row.id, owner, status)
