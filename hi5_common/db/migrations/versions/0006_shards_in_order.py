"""Indexes that give a dataset's shards of one state in order: else pages went through them all."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "0006"
down_revision: str | None = "0005"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None

_CHANGED = {"ix_shard_leased_of_dataset": "leased", "ix_shard_failed": "failed"}


def upgrade() -> None:
    for name, status in _CHANGED.items():
        op.drop_index(name, "shard")
        _create(name, ["dataset_id", "number"], status)
    _create("ix_shard_done", ["dataset_id", "number"], "done")


def downgrade() -> None:
    op.drop_index("ix_shard_done", "shard")
    for name, status in _CHANGED.items():
        op.drop_index(name, "shard")
        _create(name, ["dataset_id"], status)


def _create(name: str, columns: list[str], status: str) -> None:
    where = sa.text(f"status = '{status}'")
    op.create_index(name, "shard", columns, sqlite_where=where, postgresql_where=where)
