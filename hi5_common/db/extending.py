"""What a new dataset takes over from the one that it extends."""

from typing import Any
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from hi5_common.db.tables import DatasetRow, DeliveryRow, ShardRow
from hi5_common.domain.sharding import ShardRange
from hi5_common.domain.spec import DatasetSpec


def complete(session: Session, spec: DatasetSpec) -> UUID | None:
    """Return the newest dataset of just the spec that a spec extends, if every image of it is
    published. Its row stays locked until the commit: it cannot be deleted meanwhile.
    """
    if spec.extends is None:
        return None
    return session.scalar(
        select(DatasetRow.id)
        .join(DeliveryRow, DeliveryRow.dataset_id == DatasetRow.id)
        .where(
            DatasetRow.image_count == spec.extends.count,
            DatasetRow.spec == spec.extends.canonical_json(),
            DeliveryRow.images_done == DatasetRow.image_count,
        )
        .order_by(DatasetRow.id.desc())
        .limit(1)
        .with_for_update(of=DatasetRow)
    )


def publications(session: Session, dataset_id: UUID | None) -> dict[ShardRange, dict[str, Any]]:
    """Return what a complete dataset has published, by shard; nothing of no dataset."""
    if dataset_id is None:
        return {}
    found = session.execute(
        select(ShardRow.number, ShardRow.start, ShardRow.stop, ShardRow.publication).where(
            ShardRow.dataset_id == dataset_id, ShardRow.publication.is_not(None)
        )
    )
    return {ShardRange(row.number, row.start, row.stop): row.publication for row in found}


def is_extended(session: Session, dataset_id: UUID) -> bool:
    """Tell whether another dataset has a dataset's objects; none can come to until the commit."""
    session.execute(select(DatasetRow.id).where(DatasetRow.id == dataset_id).with_for_update())
    mine = select(DatasetRow.id).where(DatasetRow.extends_id == dataset_id).limit(1)
    return session.scalar(mine) is not None
