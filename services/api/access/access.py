"""What a request may use: the parts, and of the database what is there for its caller."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from hi5_common.db.owned import OwnedDatasets
from hi5_common.domain.access import Caller
from services.api.parts import Parts


@dataclass(frozen=True)
class Access:
    """A caller who was let in."""

    parts: Parts
    caller: Caller

    @contextmanager
    def snapshot(self) -> Iterator[OwnedDatasets]:
        """Yield the caller's datasets for reading, as they are at one moment."""
        with self.parts.database.snapshot() as session:
            yield OwnedDatasets(session, self.caller)

    @contextmanager
    def transaction(self) -> Iterator[OwnedDatasets]:
        """Yield the caller's datasets; what is changed is committed at the end of the block."""
        with self.parts.database.transaction() as session:
            yield OwnedDatasets(session, self.caller)
