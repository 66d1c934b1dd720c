"""What was planned against what is delivered: both are rows, so that no plan need be made."""

from threading import Lock
from uuid import UUID

from hi5_common.db.owned import OwnedDatasets
from hi5_common.domain.balance import Balance, balance_of

BALANCES_KEPT = 4
"""Each takes some 5 MB by default: eight thousand pairs of values."""


class Balances:
    """The balances made last. None goes stale: a sum changes only when another shard is done."""

    def __init__(self) -> None:
        self._kept: dict[tuple[UUID, int], Balance] = {}
        self._lock = Lock()

    def of(self, mine: OwnedDatasets, dataset_id: UUID) -> Balance:
        """Return requested, planned and delivered counts. Raises DatasetNotFound."""
        key = dataset_id, mine.shards_done(dataset_id)
        found = self._kept.get(key)
        return found if found is not None else self._keep(key, _balance(mine, dataset_id))

    def _keep(self, key: tuple[UUID, int], made: Balance) -> Balance:
        """Keep a balance in place of the oldest."""
        with self._lock:
            self._kept[key] = made
            for oldest in list(self._kept)[:-BALANCES_KEPT]:
                del self._kept[oldest]
        return made


def _balance(mine: OwnedDatasets, dataset_id: UUID) -> Balance:
    dataset = mine.get(dataset_id)
    plan = mine.planned(dataset_id)
    delivered = mine.delivered(dataset_id)
    return balance_of(dataset.spec, plan, delivered, dataset.images_done)
