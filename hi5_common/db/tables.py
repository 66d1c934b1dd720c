"""The tables. A migration under migrations/ mirrors every change here (a test compares them)."""

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Text,
    UniqueConstraint,
    Uuid,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from hi5_common.db.clock import UtcTime

# SQLite counts rows only in a column of exactly this type.
RowNumber = BigInteger().with_variant(Integer(), "sqlite")


class Base(DeclarativeBase):
    """Names every constraint, so that migrations can drop them on every database."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "ck": "ck_%(table_name)s_%(constraint_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s",
            "pk": "pk_%(table_name)s",
        }
    )


class DatasetRow(Base):
    """A submitted spec. Its state is never stored: it is derived from its shards.

    extends_id: the dataset whose objects are those of its first shards too. No foreign key: SQLite
    cannot take one off again, and `extending.py` locks that dataset's row instead.
    """

    __tablename__ = "dataset"
    __table_args__ = (CheckConstraint("image_count > 0", name="has_images"),)

    id: Mapped[UUID] = mapped_column(Uuid, primary_key=True)
    spec: Mapped[str] = mapped_column(Text)
    image_count: Mapped[int] = mapped_column(BigInteger)
    idempotency_key: Mapped[str | None] = mapped_column(String(255), unique=True)
    created_at: Mapped[datetime] = mapped_column(UtcTime)
    cancel_requested_at: Mapped[datetime | None] = mapped_column(UtcTime)
    extends_id: Mapped[UUID | None] = mapped_column(Uuid, index=True)


class ShardRow(Base):
    """A range of image indices, who has it, and what became of it.

    attempt is the fencing token: it grows with every claim and never falls. failures counts the
    attempts that ended badly; a shard handed back by a draining worker does not count.
    """

    __tablename__ = "shard"
    __table_args__ = (
        UniqueConstraint("dataset_id", "number"),
        UniqueConstraint("dataset_id", "start"),
        CheckConstraint("start >= 0 AND stop > start", name="range"),
        CheckConstraint(
            "(status = 'leased') = (lease_until IS NOT NULL)"
            " AND (status = 'leased') = (lease_owner IS NOT NULL)",
            name="lease",
        ),
        CheckConstraint("(status = 'done') = (publication IS NOT NULL)", name="publication"),
        Index(
            "ix_shard_pending",
            "dataset_id",
            "number",
            sqlite_where=text("status = 'pending'"),
            postgresql_where=text("status = 'pending'"),
        ),
        Index(
            "ix_shard_leased",
            "lease_until",
            sqlite_where=text("status = 'leased'"),
            postgresql_where=text("status = 'leased'"),
        ),
        Index(
            "ix_shard_leased_of_dataset",
            "dataset_id",
            "number",
            sqlite_where=text("status = 'leased'"),
            postgresql_where=text("status = 'leased'"),
        ),
        Index(
            "ix_shard_failed",
            "dataset_id",
            "number",
            sqlite_where=text("status = 'failed'"),
            postgresql_where=text("status = 'failed'"),
        ),
        Index(
            "ix_shard_done",
            "dataset_id",
            "number",
            sqlite_where=text("status = 'done'"),
            postgresql_where=text("status = 'done'"),
        ),
    )

    id: Mapped[UUID] = mapped_column(Uuid, primary_key=True)
    dataset_id: Mapped[UUID] = mapped_column(ForeignKey("dataset.id", ondelete="CASCADE"))
    number: Mapped[int] = mapped_column(Integer)
    start: Mapped[int] = mapped_column(BigInteger)
    stop: Mapped[int] = mapped_column(BigInteger)
    status: Mapped[str] = mapped_column(String(16))
    attempt: Mapped[int] = mapped_column(Integer)
    failures: Mapped[int] = mapped_column(Integer)
    progress: Mapped[int] = mapped_column(Integer)
    not_before: Mapped[datetime] = mapped_column(UtcTime)
    rung_at: Mapped[datetime | None] = mapped_column(UtcTime)
    changed_at: Mapped[datetime] = mapped_column(UtcTime)
    swept_at: Mapped[datetime | None] = mapped_column(UtcTime)
    lease_owner: Mapped[str | None] = mapped_column(String(128))
    lease_until: Mapped[datetime | None] = mapped_column(UtcTime)
    failure_reason: Mapped[str | None] = mapped_column(Text)
    publication: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))


class DeliveryRow(Base):
    """What the published shards of a dataset add up to, kept by the transactions that publish.

    A table of its own: the transactions that change a dataset's row lock its shards later.
    """

    __tablename__ = "delivery"

    dataset_id: Mapped[UUID] = mapped_column(
        ForeignKey("dataset.id", ondelete="CASCADE"), primary_key=True
    )
    shard_count: Mapped[int] = mapped_column(Integer)
    shards_done: Mapped[int] = mapped_column(Integer)
    images_done: Mapped[int] = mapped_column(BigInteger)
    images_missing: Mapped[int] = mapped_column(BigInteger)
    tallies: Mapped[dict[str, Any]] = mapped_column(JSON)


class PlannedRow(Base):
    """What the plan of a dataset adds up to, once every image is delivered; never changed.

    Kept since planning takes seconds. A table of its own: few readers of a dataset want it.
    """

    __tablename__ = "planned"

    dataset_id: Mapped[UUID] = mapped_column(
        ForeignKey("dataset.id", ondelete="CASCADE"), primary_key=True
    )
    tallies: Mapped[dict[str, Any]] = mapped_column(JSON)


class EventRow(Base):
    """Something that happened, written in the transaction that made it happen; never changed."""

    __tablename__ = "event"
    __table_args__ = (Index("ix_event_dataset_id_id", "dataset_id", "id"),)

    id: Mapped[int] = mapped_column(RowNumber, primary_key=True, autoincrement=True)
    at: Mapped[datetime] = mapped_column(UtcTime)
    dataset_id: Mapped[UUID] = mapped_column(ForeignKey("dataset.id", ondelete="CASCADE"))
    shard_number: Mapped[int | None] = mapped_column(Integer)
    attempt: Mapped[int | None] = mapped_column(Integer)
    kind: Mapped[str] = mapped_column(String(32))
    owner: Mapped[str | None] = mapped_column(String(128))
    detail: Mapped[str | None] = mapped_column(Text)


class FailureRow(Base):
    """An attempt, an image or a draw that failed; the newest of each dataset are kept."""

    __tablename__ = "failure"
    __table_args__ = (Index("ix_failure_dataset_id_id", "dataset_id", "id"),)

    id: Mapped[int] = mapped_column(RowNumber, primary_key=True, autoincrement=True)
    at: Mapped[datetime] = mapped_column(UtcTime)
    dataset_id: Mapped[UUID] = mapped_column(ForeignKey("dataset.id", ondelete="CASCADE"))
    of: Mapped[str] = mapped_column(String(16))
    shard_number: Mapped[int] = mapped_column(Integer)
    attempt: Mapped[int] = mapped_column(Integer)
    image_index: Mapped[int | None] = mapped_column(BigInteger)
    draw: Mapped[int | None] = mapped_column(Integer)
    kind: Mapped[str] = mapped_column(String(64))
    reason: Mapped[str] = mapped_column(Text)
    log: Mapped[str] = mapped_column(Text)
    owner: Mapped[str | None] = mapped_column(String(128))


class WorkerRow(Base):
    """A machine that renders. failed_shards: ids in hex with a blank between, since the last that
    it published. blocks: how often it was blocked, none published between.
    """

    __tablename__ = "worker"

    name: Mapped[str] = mapped_column(String(80), primary_key=True)
    seen_at: Mapped[datetime] = mapped_column(UtcTime)
    slots: Mapped[int] = mapped_column(Integer)
    failed_shards: Mapped[str] = mapped_column(Text)
    blocks: Mapped[int] = mapped_column(Integer)
    blocked_until: Mapped[datetime | None] = mapped_column(UtcTime)
    blocked_reason: Mapped[str | None] = mapped_column(Text)


class DeletedDatasetRow(Base):
    """A dataset that was deleted: leave to remove its objects. Unknown objects are left alone."""

    __tablename__ = "deleted_dataset"

    id: Mapped[UUID] = mapped_column(Uuid, primary_key=True)
    deleted_at: Mapped[datetime] = mapped_column(UtcTime)
