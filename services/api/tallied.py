"""Tallies of datasets, added up again only when another shard was published."""

from collections import OrderedDict
from collections.abc import Callable
from threading import Lock
from uuid import UUID

from hi5_common.domain.records import Dataset, ShardStatus, Tallies

DATASETS_KEPT = 64


class Tallied:
    """Published shards stay published: the number of them says whether an old sum still holds."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._sums: OrderedDict[UUID, tuple[int, Tallies]] = OrderedDict()

    def of(self, dataset: Dataset, add_up: Callable[[], Tallies]) -> Tallies:
        """Return the dataset's tallies; `add_up` reads them in the dataset's own snapshot."""
        done = dataset.shards_by_status.get(ShardStatus.DONE, 0)
        with self._lock:
            kept = self._sums.get(dataset.id)
        if kept is not None and kept[0] == done:
            return kept[1]
        tallies = add_up()
        with self._lock:
            self._sums[dataset.id] = done, tallies
            self._sums.move_to_end(dataset.id)
            while len(self._sums) > DATASETS_KEPT:
                self._sums.popitem(last=False)
        return tallies
