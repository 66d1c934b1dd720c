"""What each dataset's plan adds up to, kept; plans of datasets there are are made once, here."""

from collections.abc import Sequence
from dataclasses import asdict

import sqlalchemy as sa
from alembic import op

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec

revision: str = "0004"
down_revision: str | None = "0003"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None

_dataset = sa.table("dataset", sa.column("id", sa.Uuid()), sa.column("spec", sa.Text()))


def upgrade() -> None:
    planned = op.create_table(
        "planned",
        sa.Column("dataset_id", sa.Uuid(), nullable=False),
        sa.Column("tallies", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["dataset_id"], ["dataset.id"], name=op.f("fk_planned_dataset_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("dataset_id", name=op.f("pk_planned")),
    )
    connection = op.get_bind()
    for dataset_id, spec in connection.execute(sa.select(_dataset.c.id, _dataset.c.spec)).all():
        tallies = Plan.of(DatasetSpec.model_validate_json(spec)).tallies()
        row = {"dataset_id": dataset_id, "tallies": asdict(tallies)}
        connection.execute(planned.insert().values(row))


def downgrade() -> None:
    op.drop_table("planned")
