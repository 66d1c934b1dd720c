"""What a dataset has delivered, kept as a running sum; databases with shards are summed up once."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

from hi5_common.domain import tallies as counting
from hi5_common.domain.records import Tallies

revision: str = "0002"
down_revision: str | None = "0001"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None

_INDEXES = {"ix_shard_leased_of_dataset": "leased", "ix_shard_failed": "failed"}
_BATCH = 200

_shard = sa.table(
    "shard",
    sa.column("dataset_id", sa.Uuid()),
    sa.column("status", sa.String()),
    sa.column("publication", sa.JSON()),
)


def upgrade() -> None:
    delivery = op.create_table(
        "delivery",
        sa.Column("dataset_id", sa.Uuid(), nullable=False),
        sa.Column("shard_count", sa.Integer(), nullable=False),
        sa.Column("shards_done", sa.Integer(), nullable=False),
        sa.Column("images_done", sa.BigInteger(), nullable=False),
        sa.Column("tallies", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["dataset_id"], ["dataset.id"], name=op.f("fk_delivery_dataset_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("dataset_id", name=op.f("pk_delivery")),
    )
    for name, status in _INDEXES.items():
        where = sa.text(f"status = '{status}'")
        op.create_index(name, "shard", ["dataset_id"], sqlite_where=where, postgresql_where=where)
    connection = op.get_bind()
    cut = sa.select(_shard.c.dataset_id, sa.func.count()).group_by(_shard.c.dataset_id)
    for dataset_id, shard_count in connection.execute(cut).all():
        delivered = _delivered(connection, dataset_id)
        row = {"dataset_id": dataset_id, "shard_count": shard_count, **delivered}
        connection.execute(delivery.insert().values(row))


def downgrade() -> None:
    for name in _INDEXES:
        op.drop_index(name, "shard")
    op.drop_table("delivery")


def _delivered(connection: sa.Connection, dataset_id: object) -> dict[str, object]:
    shards = images = 0
    total = counting.EMPTY
    done = sa.select(_shard.c.publication).where(
        _shard.c.dataset_id == dataset_id, _shard.c.status == "done"
    )
    for batch in connection.execute(done).scalars().partitions(_BATCH):
        shards += len(batch)
        images += sum(publication["image_count"] for publication in batch)
        total = counting.add(total, *(Tallies(**each["tallies"]) for each in batch))
    tallies = {"values": total.values, "pairs": total.pairs}
    return {"shards_done": shards, "images_done": images, "tallies": tallies}
