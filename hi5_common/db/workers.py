"""The machines of the fleet: seen, blamed for bad shards, blocked for a while, unblocked.

A block is about a machine, not a process: one whose disk is full or whose GPU is gone fails in
every process it starts. Who fails, and who publishes, writes it here in the same transaction.
"""

from collections import defaultdict
from collections.abc import Iterable
from uuid import UUID

from sqlalchemy import Update, delete, select, update
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from hi5_common.db import clock, errors
from hi5_common.db.tables import DeliveryRow, ShardRow, WorkerRow
from hi5_common.domain import workers as rules
from hi5_common.domain.records import ShardStatus
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.workers import BAD_SHARDS, BusySlot, Worker

ALIVE_S = 90.0
FORGOTTEN_S = 7 * 24 * 3600.0
_REMEMBERED = 10
_UNBLOCKED = {"blocked_until": None, "blocked_reason": None}


def seen(session: Session, name: str, slots: int) -> str | None:
    """Note that a machine asked for work; return why it gets none, or None if it may claim."""
    _ensure(session, name)
    session.execute(_change(name).values(seen_at=clock.now(), slots=slots))
    return blocked(session, name)


def blocked(session: Session, name: str) -> str | None:
    """Return why a machine may not claim now, or None if it may."""
    return session.scalar(
        select(WorkerRow.blocked_reason).where(
            WorkerRow.name == name, WorkerRow.blocked_until > clock.now()
        )
    )


def failed(
    session: Session,
    name: str,
    shard_id: UUID,
    kind: FailureKind,
    reason: str,
    first_block_s: float,
) -> bool:
    """Note a shard that failed on a machine; return whether the machine is blocked for it.

    It is after BAD_SHARDS different ones in a row, for first_block_s seconds, then for twice that.
    A dataset of which nothing was ever published, and which fails on other machines too, is to
    blame itself: its shards do not count.
    """
    if not rules.blames_the_worker(kind):
        return False
    _ensure(session, name)
    row = session.scalars(
        select(WorkerRow)
        .where(WorkerRow.name == name)
        .with_for_update()
        .execution_options(populate_existing=True)
    ).one()
    shard_ids = list(dict.fromkeys([*_ids(row), shard_id]))[-_REMEMBERED:]
    session.execute(_change(name).values(failed_shards=_text(shard_ids)))
    guilty = _not_of_bad_datasets(session, name, shard_ids)
    if len(guilty) < BAD_SHARDS or blocked(session, name) is not None:
        return False
    blocks = row.blocks + 1
    pause_s = rules.block_s(first_block_s, blocks)
    why = (
        f"{len(guilty)} different shards failed here one after another, "
        f"the last of {kind.value}: {reason.splitlines()[0][:300] if reason else ''}"
    )
    session.execute(
        _change(name).values(
            blocks=blocks, blocked_until=clock.now_plus(pause_s), blocked_reason=why
        )
    )
    return True


def succeeded(session: Session, name: str) -> None:
    """Note that a machine published a shard: it is trusted again."""
    session.execute(
        _change(name)
        .where((WorkerRow.failed_shards != "") | (WorkerRow.blocks > 0))
        .values(failed_shards="", blocks=0, **_UNBLOCKED)
    )


def unblock(session: Session, name: str) -> Worker:
    """Let a machine claim again, as if nothing had failed there. Raises WorkerNotFound."""
    changed = session.execute(
        _change(name).values(failed_shards="", blocks=0, **_UNBLOCKED).returning(WorkerRow.name)
    ).all()
    if not changed:
        raise errors.WorkerNotFound(name)
    return next(worker for worker in all_of_them(session) if worker.name == name)


def all_of_them(session: Session) -> list[Worker]:
    """Return every machine seen within the last week, by its name."""
    alive = WorkerRow.seen_at > clock.now_plus(-ALIVE_S)
    still = WorkerRow.blocked_until > clock.now()
    query = (
        select(WorkerRow, alive, still)
        .order_by(WorkerRow.name)
        .execution_options(populate_existing=True)
    )
    busy = _busy(session)
    return [
        Worker(
            name=row.name,
            seen_at=row.seen_at,
            alive=bool(is_alive),
            slots=row.slots,
            busy=tuple(busy[row.name]),
            failed_shards=len(_ids(row)),
            blocked_until=row.blocked_until if is_blocked else None,
            blocked_reason=row.blocked_reason if is_blocked else None,
        )
        for row, is_alive, is_blocked in session.execute(query)
    ]


def forget_the_gone(session: Session) -> None:
    """Forget machines that were not seen for a week; containers come with a new name each time."""
    session.execute(
        delete(WorkerRow)
        .where(WorkerRow.seen_at <= clock.now_plus(-FORGOTTEN_S))
        .execution_options(synchronize_session=False)
    )


def _change(name: str) -> Update:
    return (
        update(WorkerRow).where(WorkerRow.name == name).execution_options(synchronize_session=False)
    )


def _ensure(session: Session, name: str) -> None:
    insert = (
        sqlite.insert(WorkerRow)
        if session.get_bind().dialect.name == "sqlite"
        else postgresql.insert(WorkerRow)
    )
    values = {"name": name, "seen_at": clock.now(), "slots": 0, "failed_shards": "", "blocks": 0}
    session.execute(insert.values(values).on_conflict_do_nothing())


def _not_of_bad_datasets(session: Session, name: str, shard_ids: list[UUID]) -> list[UUID]:
    """Return the shards whose failing may be this machine's fault."""
    others = session.scalars(
        select(WorkerRow).where(WorkerRow.name != name, WorkerRow.failed_shards != "")
    )
    theirs = set(_datasets(session, (each for row in others for each in _ids(row))).values())
    if not theirs:
        return shard_ids
    delivering = set(
        session.scalars(
            select(DeliveryRow.dataset_id).where(
                DeliveryRow.dataset_id.in_(theirs), DeliveryRow.shards_done > 0
            )
        )
    )
    bad = theirs - delivering
    ours = _datasets(session, shard_ids)
    return [shard_id for shard_id in shard_ids if ours.get(shard_id) not in bad]


def _datasets(session: Session, shard_ids: Iterable[UUID]) -> dict[UUID, UUID]:
    found = session.execute(
        select(ShardRow.id, ShardRow.dataset_id).where(ShardRow.id.in_(list(shard_ids)))
    )
    return {row.id: row.dataset_id for row in found}


def _busy(session: Session) -> defaultdict[str, list[BusySlot]]:
    found: defaultdict[str, list[BusySlot]] = defaultdict(list)
    leased = session.scalars(
        select(ShardRow)
        .where(ShardRow.status == ShardStatus.LEASED.value)
        .order_by(ShardRow.dataset_id, ShardRow.number)
    )
    for row in leased:
        slot = BusySlot(row.dataset_id, row.number, row.progress, row.stop - row.start)
        found[rules.worker_of(str(row.lease_owner))].append(slot)
    return found


def _ids(row: WorkerRow) -> list[UUID]:
    return [UUID(hex=text) for text in row.failed_shards.split()]


def _text(shard_ids: Iterable[UUID]) -> str:
    return " ".join(each.hex for each in shard_ids)
