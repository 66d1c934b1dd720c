"""Removing what nobody will read again, from stores that fail half-way and list what is gone."""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from hi5_common.storage import errors
from hi5_common.storage.port import ObjectStore

log = logging.getLogger(__name__)

TROUBLES_IN_A_ROW = 3
"""After so many the store is away, and the rest can wait."""


@dataclass(frozen=True)
class Removal:
    """How many objects went, and whether a listing afterwards was clean of them."""

    removed: int
    clean: bool


def remove_listed(store: ObjectStore, prefix: str, doomed: Callable[[str], bool]) -> Removal:
    """Remove the objects below a folder whose keys are doomed, until a listing shows none.

    Not clean: the store still lists what it said it deleted. Raises what the store raises.
    """
    removed: set[str] = set()
    while found := {entry.key for entry in store.list(prefix) if doomed(entry.key)}:
        if found <= removed:
            return Removal(len(removed), clean=False)
        store.delete(sorted(found))
        removed |= found
    return Removal(len(removed), clean=True)


@dataclass
class Sweep[Item]:
    """Removing for many items: the trouble of one is not the others'."""

    removed: int = 0
    clean: list[Item] = field(default_factory=list)
    trouble: errors.StoreUnavailable | errors.StoreRefused | None = None
    _in_a_row: int = 0

    def over(self, items: Iterable[Item], remove: Callable[[Item], Removal]) -> None:
        """Remove for each item; end early when the store seems to be away."""
        for item in items:
            self._one(item, remove)
            if self._in_a_row >= TROUBLES_IN_A_ROW:
                return

    def finish(self) -> int:
        """Return how many objects went; raise the last trouble if there was one."""
        if self.trouble is not None:
            raise self.trouble
        return self.removed

    def _one(self, item: Item, remove: Callable[[Item], Removal]) -> None:
        try:
            removal = remove(item)
        except (errors.StoreUnavailable, errors.StoreRefused) as error:
            log.warning("not swept: %s", error, extra={"action": "sweep_failed"})
            self.trouble = error
            self._in_a_row += 1
            return
        self._in_a_row = 0
        self.removed += removal.removed
        if removal.clean:
            self.clean.append(item)
