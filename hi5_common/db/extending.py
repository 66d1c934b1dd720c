"""What a new dataset takes over from the one that it extends."""

from dataclasses import dataclass
from typing import Protocol
from uuid import UUID

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from hi5_common.db import deliveries, rows
from hi5_common.db.tables import DatasetRow, DeliveryRow, ShardRow
from hi5_common.domain.records import Publication, Tallies
from hi5_common.domain.sharding import ShardRange
from hi5_common.domain.spec import DatasetSpec


class PlanOfMore(Protocol):
    """What is asked of the plan of a dataset that extends another."""

    def tallies_of_first(self, count: int) -> Tallies:
        """Return what the first images add up to."""
        ...


@dataclass(frozen=True)
class TakenOver:
    """What a dataset has of its base from the first: shards without gaps, and their sum."""

    base_id: UUID
    images: int
    publications: dict[ShardRange, Publication]
    tallies: Tallies


def taken_over(
    session: Session, owner: str, spec: DatasetSpec, plan: PlanOfMore, cuts: frozenset[ShardRange]
) -> TakenOver | None:
    """Return what the owner's newest complete dataset of just the spec extended gives a new one.

    None if there is no such dataset, or if what it has published is not what is planned now (by
    another version of hi5: other cuts, or other images): then all is rendered again. Its row stays
    locked until the commit: it cannot be deleted meanwhile.
    """
    base_id = _complete(session, owner, spec)
    if spec.extends is None or base_id is None:
        return None
    published = _publications(session, base_id)
    delivered = _tallies(deliveries.tallies(session, base_id), spec, spec.extends, plan)
    if delivered is None or not published.keys() <= cuts:
        return None
    return TakenOver(base_id, spec.extends.count, published, delivered)


def is_extended(session: Session, dataset_id: UUID) -> bool:
    """Tell whether another dataset has a dataset's objects; none can come to until the commit."""
    session.execute(_locked(select(DatasetRow.id).where(DatasetRow.id == dataset_id)))
    mine = select(DatasetRow.id).where(DatasetRow.extends_id == dataset_id).limit(1)
    return session.scalar(mine) is not None


def _complete(session: Session, owner: str, spec: DatasetSpec) -> UUID | None:
    if spec.extends is None:
        return None
    found = (
        select(DatasetRow.id)
        .join(DeliveryRow, DeliveryRow.dataset_id == DatasetRow.id)
        .where(
            DatasetRow.owner == owner,
            DatasetRow.image_count == spec.extends.count,
            DatasetRow.spec == spec.extends.canonical_json(),
            DeliveryRow.images_done == DatasetRow.image_count,
        )
        .order_by(DatasetRow.id.desc())
        .limit(1)
    )
    return session.scalar(_locked(found))


def _locked(dataset: Select[UUID]) -> Select[UUID]:
    """Lock a dataset's row against others that lock it so, and not against its workers.

    A worker that finishes holds its shard and then needs the row to be there (FOR KEY SHARE), to
    write an event; who deletes has the row and then needs the shards.
    """
    return dataset.with_for_update(of=DatasetRow, key_share=True)


def _publications(session: Session, dataset_id: UUID) -> dict[ShardRange, Publication]:
    found = session.execute(
        select(ShardRow.number, ShardRow.start, ShardRow.stop, ShardRow.publication).where(
            ShardRow.dataset_id == dataset_id, ShardRow.publication.is_not(None)
        )
    )
    return {
        ShardRange(row.number, row.start, row.stop): rows.publication(row.publication)
        for row in found
    }


def _tallies(
    delivered: Tallies, spec: DatasetSpec, base: DatasetSpec, plan: PlanOfMore
) -> Tallies | None:
    """Return what a base's images add up to, with the pairs that a spec counts.

    Those were counted as they came, unless the base has one value of what now has more: then they
    are the plan's, if all that was counted is what it says.
    """
    if spec.balanced() == base.balanced():
        return delivered
    planned = plan.tallies_of_first(base.count)
    return planned if planned.values == delivered.values else None
