"""Keys to the API, owners of datasets, what they cost. What is there is the local owner's."""

from collections.abc import Sequence

import sqlalchemy as sa
from alembic import op

from hi5_common.db.clock import UtcTime
from hi5_common.domain.cost import cost_of
from hi5_common.domain.spec import DatasetSpec

revision: str = "0009"
down_revision: str | None = "0008"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None

_OWNER = "local"
_dataset = sa.table(
    "dataset",
    sa.column("id", sa.Uuid()),
    sa.column("spec", sa.Text()),
    sa.column("idempotency_key", sa.String()),
    sa.column("owner", sa.String()),
    sa.column("pixels", sa.BigInteger()),
    sa.column("samples", sa.BigInteger()),
)


def upgrade() -> None:
    # Not in a batch: SQLite would make the table anew, and drop what hangs on its rows.
    op.add_column(
        "dataset", sa.Column("owner", sa.String(40), nullable=False, server_default=_OWNER)
    )
    for name in ("pixels", "samples"):
        op.add_column(
            "dataset", sa.Column(name, sa.BigInteger(), nullable=False, server_default="0")
        )
    op.create_index(op.f("ix_dataset_owner_id"), "dataset", ["owner", "id"])
    op.create_table(
        "api_key",
        sa.Column("id", sa.String(16), nullable=False),
        sa.Column("secret_sha256", sa.String(64), nullable=False),
        sa.Column("owner", sa.String(40), nullable=False),
        sa.Column("scope", sa.String(8), nullable=False),
        sa.Column("note", sa.String(100), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.Column("expires_at", UtcTime()),
        sa.Column("revoked_at", UtcTime()),
        sa.Column("last_used_at", UtcTime()),
        sa.Column("max_images", sa.BigInteger()),
        sa.Column("max_pixels", sa.BigInteger()),
        sa.Column("max_samples", sa.BigInteger()),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_api_key")),
    )
    op.create_index(op.f("ix_api_key_owner"), "api_key", ["owner"])
    op.create_table(
        "browser_token",
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("kind", sa.String(8), nullable=False),
        sa.Column("key_id", sa.String(16), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["key_id"], ["api_key.id"], name=op.f("fk_browser_token_key_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("sha256", name=op.f("pk_browser_token")),
    )
    for column in ("key_id", "expires_at"):
        op.create_index(op.f(f"ix_browser_token_{column}"), "browser_token", [column])
    _count_and_name()


def downgrade() -> None:
    op.drop_table("browser_token")
    op.drop_table("api_key")
    _forget_names()
    op.drop_index(op.f("ix_dataset_owner_id"), "dataset")
    for name in ("samples", "pixels", "owner"):
        op.drop_column("dataset", name)


def _count_and_name() -> None:
    connection = op.get_bind()
    found = connection.execute(
        sa.select(_dataset.c.id, _dataset.c.spec, _dataset.c.idempotency_key)
    ).all()
    for dataset_id, spec, key in found:
        cost = cost_of(DatasetSpec.model_validate_json(spec))
        connection.execute(
            _dataset.update()
            .where(_dataset.c.id == dataset_id)
            .values(
                pixels=cost.pixels,
                samples=cost.samples,
                idempotency_key=None if key is None else f"{_OWNER}/{key}",
            )
        )


def _forget_names() -> None:
    """Leave the local owner's keys as they were; those of others, which may be the same, go."""
    connection = op.get_bind()
    found = connection.execute(
        sa.select(_dataset.c.id, _dataset.c.owner, _dataset.c.idempotency_key).where(
            _dataset.c.idempotency_key.is_not(None)
        )
    ).all()
    for dataset_id, owner, key in found:
        plain = key.removeprefix(f"{_OWNER}/") if owner == _OWNER else None
        connection.execute(
            _dataset.update().where(_dataset.c.id == dataset_id).values(idempotency_key=plain)
        )
