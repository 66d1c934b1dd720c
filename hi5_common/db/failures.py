"""What failed, written in the transaction that settles it, the newest thousand of a dataset."""

from collections.abc import Sequence
from typing import Any
from uuid import UUID

from sqlalchemy import delete, insert, select
from sqlalchemy.orm import Session

from hi5_common.db import clock
from hi5_common.db.tables import FailureRow, ShardRow
from hi5_common.domain.failures import Failure, FailureOf, Told
from hi5_common.domain.records import Publication
from hi5_common.domain.retry import FailureKind

KEPT = 1000


def of_dataset(
    session: Session, dataset_id: UUID, limit: int, before: int | None = None
) -> list[Failure]:
    """Return what failed, the newest first: all, or what is older than the failure `before`."""
    query = select(FailureRow).where(FailureRow.dataset_id == dataset_id)
    if before is not None:
        query = query.where(FailureRow.id < before)
    rows = session.scalars(query.order_by(FailureRow.id.desc()).limit(limit))
    return [_failure(row) for row in rows]


def record_attempt(
    session: Session,
    shard: ShardRow,
    kind: FailureKind,
    reason: str,
    *,
    owner: str | None,
    index: int | None,
) -> None:
    """Write that an attempt came to nothing; index is the image it was about, if about one."""
    told = Told.of(reason, kind.value)
    draw = None if index is None else 0
    _insert(session, shard, owner, [_values(FailureOf.ATTEMPT, told, index, draw)])


def record_images(
    session: Session, shard: ShardRow, publication: Publication, *, owner: str
) -> None:
    """Write which images of a published shard are gaps or later draws of their cells."""
    gaps = [_values(FailureOf.GAP, Told.of(g.reason), g.index, 0) for g in publication.gaps]
    redraws = [
        _values(FailureOf.REDRAW, Told.of(one.reason), one.index, one.draw - 1)
        for one in publication.redraws
    ]
    _insert(session, shard, owner, (redraws + gaps)[-KEPT:])


def _values(of: FailureOf, told: Told, index: int | None, draw: int | None) -> dict[str, Any]:
    return {
        "of": of.value,
        "image_index": index,
        "draw": draw,
        "kind": told.kind,
        "reason": told.reason,
        "log": told.log,
    }


def _insert(
    session: Session, shard: ShardRow, owner: str | None, values: Sequence[dict[str, Any]]
) -> None:
    if not values:
        return
    of_all = {
        "at": clock.now(),
        "dataset_id": shard.dataset_id,
        "shard_number": shard.number,
        "attempt": shard.attempt,
        "owner": owner,
    }
    session.execute(insert(FailureRow).values([{**of_all, **each} for each in values]))
    oldest_kept = (
        select(FailureRow.id)
        .where(FailureRow.dataset_id == shard.dataset_id)
        .order_by(FailureRow.id.desc())
        .offset(KEPT - 1)
        .limit(1)
        .scalar_subquery()
    )
    # What another transaction is deleting is as good as gone: nobody waits for it.
    doomed = (
        select(FailureRow.id)
        .where(FailureRow.dataset_id == shard.dataset_id, FailureRow.id < oldest_kept)
        .with_for_update(skip_locked=True)
    )
    session.execute(
        delete(FailureRow)
        .where(FailureRow.id.in_(doomed))
        .execution_options(synchronize_session=False)
    )


def _failure(row: FailureRow) -> Failure:
    return Failure(
        id=row.id,
        at=row.at,
        of=FailureOf(row.of),
        shard_number=row.shard_number,
        attempt=row.attempt,
        index=row.image_index,
        draw=row.draw,
        kind=row.kind,
        reason=row.reason,
        log=row.log,
        owner=row.owner,
    )
