"""How many images of done shards are gaps, in the running sum; what is there is counted once."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

revision: str = "0003"
down_revision: str | None = "0002"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None

_COUNT = """
UPDATE delivery SET images_missing = (
    SELECT COALESCE(SUM(stop - start), 0) FROM shard
    WHERE shard.dataset_id = delivery.dataset_id AND shard.status = 'done'
) - images_done
"""


def upgrade() -> None:
    column = sa.Column("images_missing", sa.BigInteger(), nullable=False, server_default="0")
    with op.batch_alter_table("delivery") as table:
        table.add_column(column)
    op.execute(_COUNT)
    with op.batch_alter_table("delivery") as table:
        table.alter_column("images_missing", server_default=None)


def downgrade() -> None:
    with op.batch_alter_table("delivery") as table:
        table.drop_column("images_missing")
