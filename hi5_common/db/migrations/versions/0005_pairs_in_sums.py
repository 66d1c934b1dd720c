"""Pairs are counted in a dataset's sum alone: most of a shard's row was pairs that nobody read.

The way back counts them again: every delivered image has its cell of the plan.
"""

from collections.abc import Callable, Sequence
from typing import Any

import sqlalchemy as sa
from alembic import op

from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Gap, without_gaps
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.tallies import tally

revision: str = "0005"
down_revision: str | None = "0004"
branch_labels: str | Sequence[str] | None = None
depends_on: str | Sequence[str] | None = None

_dataset = sa.table("dataset", sa.column("id", sa.Uuid()), sa.column("spec", sa.Text()))
_shard = sa.table(
    "shard",
    sa.column("id", sa.Uuid()),
    sa.column("dataset_id", sa.Uuid()),
    sa.column("start", sa.BigInteger()),
    sa.column("stop", sa.BigInteger()),
    sa.column("status", sa.String()),
    sa.column("publication", sa.JSON()),
)


def upgrade() -> None:
    for dataset_id in op.get_bind().scalars(sa.select(_dataset.c.id)).all():
        _set_pairs(dataset_id, lambda _: {})


def downgrade() -> None:
    for dataset_id, spec in op.get_bind().execute(sa.select(_dataset.c.id, _dataset.c.spec)).all():
        plan = Plan.of(DatasetSpec.model_validate_json(spec))

        def pairs(row: Any, plan: Plan = plan) -> dict[str, int]:
            gaps = [Gap(**gap) for gap in row.publication.get("gaps", ())]
            images = without_gaps(row.start, row.stop, gaps)
            return tally((plan.cell(index).as_dict() for index in images), plan.crossed).pairs

        _set_pairs(dataset_id, pairs)


def _set_pairs(dataset_id: object, pairs_of: Callable[[Any], dict[str, int]]) -> None:
    """Write the pairs of every published shard, one row at a time: they may be many."""
    connection = op.get_bind()
    done = sa.select(_shard.c.id).where(
        _shard.c.dataset_id == dataset_id, _shard.c.status == "done"
    )
    for shard_id in connection.scalars(done).all():
        mine = _shard.c.id == shard_id
        row = connection.execute(sa.select(_shard).where(mine)).one()
        tallies = {**row.publication["tallies"], "pairs": pairs_of(row)}
        publication = {**row.publication, "tallies": tallies}
        connection.execute(_shard.update().where(mine).values(publication=publication))
