"""Every transition of a shard, each one guarded statement and one event in one transaction.

A worker proves with (shard_id, attempt, owner) that it still holds the lease. A statement that
matches no row raises LeaseLost: the worker then drops everything it has. Renewal does not ask
whether the lease ran out: as long as nobody else took the shard, being late is harmless.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from sqlalchemy import ColumnElement, Select, and_, func, or_, select, update
from sqlalchemy.orm import Session

from hi5_common.db import clock, deliveries, errors, events, failures, rows
from hi5_common.db.tables import DatasetRow, EventRow, ShardRow
from hi5_common.domain import lifecycle, retry
from hi5_common.domain.lifecycle import DatasetEvent, Transition
from hi5_common.domain.records import Publication, Shard, ShardStatus
from hi5_common.domain.retry import FailureKind, GiveUp


@dataclass(frozen=True)
class RenewAnswer:
    """What the database told a worker that renewed its lease."""

    cancel_requested: bool


def claim(session: Session, hint: UUID | None, owner: str, lease_s: float) -> Shard | None:
    """Lease the hinted shard, or else the oldest pending one, for lease_s seconds.

    Returns the shard with its new attempt number, the fencing token; None if nothing is due.
    No two claims ever return the same attempt of a shard.
    """
    for candidate in (_due().where(ShardRow.id == hint) if hint else None, _oldest_due()):
        if candidate is None:
            continue
        claimed = _transition(
            session,
            Transition.CLAIM,
            ShardRow.id == candidate.with_for_update(skip_locked=True).limit(1).scalar_subquery(),
            attempt=ShardRow.attempt + 1,
            progress=0,
            lease_owner=owner,
            lease_until=clock.now_plus(lease_s),
            failure_reason=None,
        )
        if claimed is not None:
            events.record_shards(session, [claimed.id], Transition.CLAIM, owner=owner)
            return rows.shard(claimed)
    return None


def renew(
    session: Session, shard_id: UUID, attempt: int, owner: str, lease_s: float, progress: int
) -> RenewAnswer:
    """Extend a lease to lease_s seconds from now and note how many images are rendered.

    Raises LeaseLost.
    """
    dataset_id = session.scalar(
        update(ShardRow)
        .where(_held(shard_id, attempt, owner))
        .values(lease_until=clock.now_plus(lease_s), progress=progress)
        .returning(ShardRow.dataset_id)
        .execution_options(synchronize_session=False)
    )
    if dataset_id is None:
        raise errors.LeaseLost
    return RenewAnswer(_cancel_requested(session, dataset_id))


def finish(
    session: Session, shard_id: UUID, attempt: int, owner: str, publication: Publication
) -> None:
    """Publish what an attempt made. From here on readers see it.

    The same attempt may finish twice with the same publication: a commit whose answer was lost is
    simply sent again. Raises LeaseLost, or WrongCount if images are missing that are no gaps.
    """
    document = rows.publication_document(publication)
    finished = _transition(
        session,
        Transition.FINISH,
        and_(
            _held(shard_id, attempt, owner),
            ShardRow.stop - ShardRow.start == publication.image_count + len(publication.gaps),
        ),
        publication=document,
        progress=publication.image_count,
        **_NO_LEASE,
    )
    if finished is not None:
        events.record_shards(
            session, [shard_id], Transition.FINISH, owner=owner, detail=publication.trouble()
        )
        failures.record_images(session, finished, publication, owner=owner)
        deliveries.add(session, finished.dataset_id, publication)
        return
    _explain_refusal(session, shard_id, attempt, document)


def fail(
    session: Session,
    shard_id: UUID,
    attempt: int,
    owner: str,
    kind: FailureKind,
    reason: str,
    index: int | None = None,
) -> ShardStatus:
    """End an attempt without a publication; return whether the shard is pending again or failed.

    index: the image to blame, if one is. Raises LeaseLost, also when this attempt has failed
    already.
    """
    row = session.scalar(select(ShardRow).where(_held(shard_id, attempt, owner)).with_for_update())
    if row is None:
        raise errors.LeaseLost
    return give_back(session, row, kind, reason, owner=owner, index=index)


def release(session: Session, shard_id: UUID, attempt: int, owner: str) -> None:
    """Hand a shard back unfinished, to be claimed by anybody at once. It does not count as a
    failure. Raises LeaseLost.
    """
    released = _transition(
        session,
        Transition.RELEASE,
        _held(shard_id, attempt, owner),
        not_before=clock.now(),
        rung_at=None,
        progress=0,
        **_NO_LEASE,
    )
    if released is None:
        raise errors.LeaseLost
    events.record_shards(session, [shard_id], Transition.RELEASE, owner=owner)


def cancel(session: Session, shard_id: UUID, attempt: int, owner: str) -> None:
    """Drop a shard whose dataset was cancelled. Raises LeaseLost."""
    cancelled = _transition(
        session, Transition.CANCEL, _held(shard_id, attempt, owner), progress=0, **_NO_LEASE
    )
    if cancelled is None:
        raise errors.LeaseLost
    events.record_shards(session, [shard_id], Transition.CANCEL, owner=owner)


def of_dataset(
    session: Session,
    dataset_id: UUID,
    limit: int,
    after_number: int | None = None,
    status: ShardStatus | None = None,
) -> list[Shard]:
    """Return shards in order of their number, those after `after_number` (None: from the first)."""
    query = select(ShardRow).where(ShardRow.dataset_id == dataset_id)
    if after_number is not None:
        query = query.where(ShardRow.number > after_number)
    if status is not None:
        query = query.where(ShardRow.status == status.value)
    found = session.scalars(query.order_by(ShardRow.number).limit(limit))
    return [rows.shard(row) for row in found]


def in_trouble(session: Session, dataset_id: UUID, limit: int) -> list[Shard]:
    """Return the first published shards that have gaps or redraws, in order of their number.

    Found by their events, of finishing or of being taken over, which are small: a publication's
    own JSON may have a hundred kilobytes.
    """
    told = select(EventRow.shard_number).where(
        EventRow.dataset_id == dataset_id,
        EventRow.kind.in_([Transition.FINISH.value, DatasetEvent.TAKE_OVER.value]),
        EventRow.shard_number.is_not(None),
        EventRow.detail.is_not(None),
    )
    found = session.scalars(
        select(ShardRow)
        .where(
            ShardRow.dataset_id == dataset_id,
            ShardRow.number.in_(told),
            ShardRow.status == ShardStatus.DONE.value,
        )
        .order_by(ShardRow.number)
        .limit(limit)
    )
    return [rows.shard(row) for row in found]


def get(session: Session, dataset_id: UUID, number: int) -> Shard:
    """Return one shard by its number. Raises ShardNotFound."""
    row = session.scalar(
        select(ShardRow).where(ShardRow.dataset_id == dataset_id, ShardRow.number == number)
    )
    if row is None:
        raise errors.ShardNotFound
    return rows.shard(row)


def containing(session: Session, dataset_id: UUID, index: int) -> Shard:
    """Return the shard that image `index` belongs to. Raises DatasetNotFound or ImageNotFound."""
    count = session.scalar(select(DatasetRow.image_count).where(DatasetRow.id == dataset_id))
    if count is None:
        raise errors.DatasetNotFound(dataset_id)
    row = session.scalar(
        select(ShardRow)
        .where(ShardRow.dataset_id == dataset_id, ShardRow.start <= index)
        .order_by(ShardRow.start.desc())
        .limit(1)
    )
    if row is None or index >= row.stop:
        raise errors.ImageNotFound(index, count)
    return rows.shard(row)


def pending_to_ring(session: Session, limit: int, ring_s: float) -> list[UUID]:
    """Return up to `limit` due shards nobody was told about for ring_s seconds, and note that
    they are being told about now. Ring after the commit.
    """
    due = (
        _oldest_due()
        .where(or_(ShardRow.rung_at.is_(None), ShardRow.rung_at <= clock.now_plus(-ring_s)))
        .limit(limit)
        .with_for_update(skip_locked=True)
    )
    chosen = list(session.scalars(due))
    if chosen:
        session.execute(
            update(ShardRow)
            .where(ShardRow.id.in_(chosen))
            .values(rung_at=clock.now())
            .execution_options(synchronize_session=False)
        )
    return chosen


def any_due(session: Session) -> bool:
    """Return whether a claim would find something now. It locks nothing."""
    return session.scalar(_due().limit(1)) is not None


def give_back(
    session: Session,
    row: ShardRow,
    kind: FailureKind,
    reason: str,
    *,
    owner: str | None,
    index: int | None = None,
) -> ShardStatus:
    """Settle an attempt that ended badly, by the retry decision. The row must be locked."""
    times = row.failures + 1
    decision = retry.decide(kind, times)
    if _cancel_requested(session, row.dataset_id):
        transition, delay_s = Transition.CANCEL, 0.0
    elif isinstance(decision, GiveUp):
        transition, delay_s = Transition.FAIL, 0.0
    else:
        expired = kind is FailureKind.LEASE_EXPIRED
        transition = Transition.EXPIRE if expired else Transition.RETRY
        delay_s = decision.delay_s
    _transition(
        session,
        transition,
        and_(ShardRow.id == row.id, ShardRow.attempt == row.attempt),
        failures=times,
        failure_reason=f"{kind.value}: {reason}",
        not_before=clock.now_plus(delay_s),
        rung_at=None,
        progress=0,
        **_NO_LEASE,
    )
    detail = f"{kind.value}: {reason}"
    events.record_shards(session, [row.id], transition, owner=owner, detail=detail)
    failures.record_attempt(session, row, kind, reason, owner=owner, index=index)
    return lifecycle.target(transition)


_NO_LEASE: dict[str, Any] = {"lease_owner": None, "lease_until": None}


def _transition(
    session: Session, transition: Transition, guard: ColumnElement[bool], **values: Any
) -> ShardRow | None:
    """Move the one row that the guard and the transition table allow; None if there is none."""
    return session.scalars(
        update(ShardRow)
        .where(guard, ShardRow.status.in_(_names(lifecycle.sources(transition))))
        .values(status=lifecycle.target(transition).value, changed_at=clock.now(), **values)
        .returning(ShardRow)
        .execution_options(synchronize_session=False, populate_existing=True)
    ).one_or_none()


def _names(states: frozenset[ShardStatus]) -> Sequence[str]:
    return sorted(state.value for state in states)


def _held(shard_id: UUID, attempt: int, owner: str) -> ColumnElement[bool]:
    return and_(
        ShardRow.id == shard_id,
        ShardRow.attempt == attempt,
        ShardRow.lease_owner == owner,
        ShardRow.status == ShardStatus.LEASED.value,
    )


def _due() -> Select[UUID]:
    return select(ShardRow.id).where(
        ShardRow.status == ShardStatus.PENDING.value, ShardRow.not_before <= clock.now()
    )


def _oldest_due() -> Select[UUID]:
    # Dataset ids begin with their time of creation, so the first dataset is served first.
    return _due().order_by(ShardRow.dataset_id, ShardRow.number)


def _cancel_requested(session: Session, dataset_id: UUID) -> bool:
    asked = select(func.count()).where(
        DatasetRow.id == dataset_id, DatasetRow.cancel_requested_at.is_not(None)
    )
    return bool(session.scalar(asked))


def _explain_refusal(
    session: Session, shard_id: UUID, attempt: int, document: dict[str, Any]
) -> None:
    row = session.scalar(select(ShardRow).where(ShardRow.id == shard_id))
    if row is None or row.attempt != attempt:
        raise errors.LeaseLost
    if row.status == ShardStatus.DONE.value and row.publication == document:
        return
    if row.status != ShardStatus.LEASED.value:
        raise errors.LeaseLost
    asked = row.stop - row.start
    made, gaps = document["image_count"], len(document["gaps"])
    if asked == made + gaps:
        raise errors.LeaseLost
    told = f"{made} images and {gaps} gaps"
    raise errors.WrongCount(f"Shard {row.number} has {asked} indices, the publication {told}.")
