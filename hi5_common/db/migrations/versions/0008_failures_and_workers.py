"""What failed, to look into; and the machines, which may be blocked for it."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

from hi5_common.db.clock import UtcTime
from hi5_common.db.tables import RowNumber

revision: str = "0008"
down_revision: str | None = "0007"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None


def upgrade() -> None:
    # New tables and nothing else: no lease, and no worker that renews one, notices.
    op.create_table(
        "failure",
        sa.Column("id", RowNumber, autoincrement=True, nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("dataset_id", sa.Uuid(), nullable=False),
        sa.Column("of", sa.String(16), nullable=False),
        sa.Column("shard_number", sa.Integer(), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("image_index", sa.BigInteger(), nullable=True),
        sa.Column("draw", sa.Integer(), nullable=True),
        sa.Column("kind", sa.String(64), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("log", sa.Text(), nullable=False),
        sa.Column("owner", sa.String(128), nullable=True),
        sa.ForeignKeyConstraint(
            ["dataset_id"],
            ["dataset.id"],
            name=op.f("fk_failure_dataset_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_failure")),
    )
    op.create_index("ix_failure_dataset_id_id", "failure", ["dataset_id", "id"])
    op.create_table(
        "worker",
        sa.Column("name", sa.String(80), nullable=False),
        sa.Column("seen_at", UtcTime(), nullable=False),
        sa.Column("slots", sa.Integer(), nullable=False),
        sa.Column("failed_shards", sa.Text(), nullable=False),
        sa.Column("blocks", sa.Integer(), nullable=False),
        sa.Column("blocked_until", UtcTime(), nullable=True),
        sa.Column("blocked_reason", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_worker")),
    )


def downgrade() -> None:
    op.drop_table("worker")
    op.drop_index("ix_failure_dataset_id_id", "failure")
    op.drop_table("failure")
