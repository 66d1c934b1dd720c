"""Datasets, shards, events and the graves of deleted datasets."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

from hi5_common.db.clock import UtcTime

revision: str = "0001"
down_revision: str | None = None
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None

_ROW_NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "dataset",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("spec", sa.Text(), nullable=False),
        sa.Column("image_count", sa.BigInteger(), nullable=False),
        sa.Column("idempotency_key", sa.String(255)),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.Column("cancel_requested_at", UtcTime()),
        sa.CheckConstraint("image_count > 0", name=op.f("ck_dataset_has_images")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_dataset")),
        sa.UniqueConstraint("idempotency_key", name=op.f("uq_dataset_idempotency_key")),
    )
    op.create_table(
        "shard",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("dataset_id", sa.Uuid(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("start", sa.BigInteger(), nullable=False),
        sa.Column("stop", sa.BigInteger(), nullable=False),
        sa.Column("status", sa.String(16), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("failures", sa.Integer(), nullable=False),
        sa.Column("progress", sa.Integer(), nullable=False),
        sa.Column("not_before", UtcTime(), nullable=False),
        sa.Column("rung_at", UtcTime()),
        sa.Column("changed_at", UtcTime(), nullable=False),
        sa.Column("swept_at", UtcTime()),
        sa.Column("lease_owner", sa.String(128)),
        sa.Column("lease_until", UtcTime()),
        sa.Column("failure_reason", sa.Text()),
        sa.Column("publication", sa.JSON(none_as_null=True)),
        sa.CheckConstraint("start >= 0 AND stop > start", name=op.f("ck_shard_range")),
        sa.CheckConstraint(
            "(status = 'leased') = (lease_until IS NOT NULL)"
            " AND (status = 'leased') = (lease_owner IS NOT NULL)",
            name=op.f("ck_shard_lease"),
        ),
        sa.CheckConstraint(
            "(status = 'done') = (publication IS NOT NULL)", name=op.f("ck_shard_publication")
        ),
        sa.ForeignKeyConstraint(
            ["dataset_id"], ["dataset.id"], name=op.f("fk_shard_dataset_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_shard")),
        sa.UniqueConstraint("dataset_id", "number", name=op.f("uq_shard_dataset_id_number")),
        sa.UniqueConstraint("dataset_id", "start", name=op.f("uq_shard_dataset_id_start")),
    )
    _partial_index("ix_shard_pending", ["dataset_id", "number"], "status = 'pending'")
    _partial_index("ix_shard_leased", ["lease_until"], "status = 'leased'")
    op.create_table(
        "event",
        sa.Column("id", _ROW_NUMBER, autoincrement=True, nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("dataset_id", sa.Uuid(), nullable=False),
        sa.Column("shard_number", sa.Integer()),
        sa.Column("attempt", sa.Integer()),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("owner", sa.String(128)),
        sa.Column("detail", sa.Text()),
        sa.ForeignKeyConstraint(
            ["dataset_id"], ["dataset.id"], name=op.f("fk_event_dataset_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_event")),
    )
    op.create_index("ix_event_dataset_id_id", "event", ["dataset_id", "id"])
    op.create_table(
        "deleted_dataset",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("deleted_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_deleted_dataset")),
    )


def downgrade() -> None:
    for table in ("deleted_dataset", "event", "shard", "dataset"):
        op.drop_table(table)


def _partial_index(name: str, columns: list[str], condition: str) -> None:
    where = sa.text(condition)
    op.create_index(name, "shard", columns, sqlite_where=where, postgresql_where=where)
