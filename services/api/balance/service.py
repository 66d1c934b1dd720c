"""What was planned against what is delivered: both are rows, so that no plan need be made."""

from uuid import UUID

from hi5_common.db import datasets, deliveries, planned
from hi5_common.domain.balance import Balance, balance_of
from services.api.parts import Parts


def balance(parts: Parts, dataset_id: UUID) -> Balance:
    """Return requested, planned and delivered counts. Raises DatasetNotFound."""
    with parts.database.snapshot() as session:
        dataset = datasets.get(session, dataset_id)
        plan = planned.tallies(session, dataset_id)
        delivered = deliveries.tallies(session, dataset_id)
    return balance_of(dataset.spec, plan, delivered, dataset.images_done)
