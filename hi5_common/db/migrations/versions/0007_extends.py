"""Which dataset another extends: the objects of its first shards are that one's."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "0007"
down_revision: str | None = "0006"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None


def upgrade() -> None:
    # Not in a batch: SQLite would make the table anew, and drop what hangs on its rows.
    op.add_column("dataset", sa.Column("extends_id", sa.Uuid(), nullable=True))
    op.create_index(op.f("ix_dataset_extends_id"), "dataset", ["extends_id"])


def downgrade() -> None:
    op.drop_index(op.f("ix_dataset_extends_id"), "dataset")
    op.drop_column("dataset", "extends_id")
