"""The real database, store and doorbell, each behind a wrapper that fails as it is told to."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from uuid import UUID

from hi5_common.db.engine import Database, Session
from hi5_common.db.errors import DatabaseUnavailable
from hi5_common.queue.errors import BrokerUnavailable
from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.storage.errors import StoreUnavailable
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.open import memory_store
from hi5_common.storage.port import Heed, ObjectEntry, ObjectHead, ObjectStore, unheeding


class CommitFault(StrEnum):
    """How a transaction may end, as its caller sees it."""

    NONE = "none"
    AWAY = "away"
    """The database cannot be reached."""
    FAILED = "failed"
    """Every statement went well and the commit did not."""
    UNKNOWN = "unknown"
    """Committed, and the answer was lost."""


@dataclass(frozen=True)
class FaultyDatabase(Database):
    """A database of which the next transactions end as `faults` says, and all others well."""

    faults: list[CommitFault] = field(default_factory=list)

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """Yield a session of the real database."""
        fault = self.faults.pop(0) if self.faults else CommitFault.NONE
        if fault is CommitFault.AWAY:
            raise DatabaseUnavailable("away")
        with super().transaction() as session:
            yield session
            if fault is CommitFault.FAILED:
                raise DatabaseUnavailable("broke off before the commit")
        if fault is CommitFault.UNKNOWN:
            raise DatabaseUnavailable("broke off after the commit")


class StoreFault(StrEnum):
    """How an operation of a store may end."""

    NONE = "none"
    FAILED = "failed"
    """Nothing happened, and the store says so."""
    LANDED = "landed"
    """It happened, and the store says that it did not."""
    CUT = "cut"
    """A part of the bytes was stored, and the store says that all is well."""
    SWAPPED = "swapped"
    """Other bytes of the same number were stored, and the store says that all is well."""
    LATE = "late"
    """The store gave up, and the bytes are on their way still."""


@dataclass
class FaultyStore:
    """A store whose next operations end as `faults` says, and all others well.

    version grows with every change of an object.
    """

    inner: ObjectStore = field(default_factory=memory_store)
    faults: list[StoreFault] = field(default_factory=list)
    on_their_way: list[tuple[float, str, bytes, str]] = field(default_factory=list)
    version: int = 0
    now_s: Callable[[], float] = time.monotonic

    def put(self, key: str, source: Path | bytes, sha256: str, heed: Heed = unheeding) -> None:
        heed()
        data = source if isinstance(source, bytes) else source.read_bytes()
        fault = self._next()
        if fault is StoreFault.LATE:
            self.on_their_way.append((self.now_s(), key, data, sha256))
        elif fault is StoreFault.CUT:
            self._overwrite(key, data[:-1])
        elif fault is StoreFault.SWAPPED:
            self._overwrite(key, data[::-1])
        elif fault is not StoreFault.FAILED:
            self.version += 1
            self.inner.put(key, source, sha256)
        if fault in {StoreFault.LATE, StoreFault.FAILED, StoreFault.LANDED}:
            raise StoreUnavailable(f"{key}: {fault.value}")

    def land(self) -> None:
        """Let everything arrive that is on its way."""
        for _, key, data, sha256 in self.on_their_way:
            self.version += 1
            self.inner.put(key, data, sha256)
        self.on_their_way.clear()

    def forget(self, older_than_s: float) -> None:
        """Let everything be lost that has been on its way for longer."""
        since_s = self.now_s() - older_than_s
        self.on_their_way = [put for put in self.on_their_way if put[0] >= since_s]

    def get(self, key: str) -> bytes:
        return self.inner.get(key)

    def get_range(self, key: str, start: int, stop: int) -> bytes:
        return self.inner.get_range(key, start, stop)

    def head(self, key: str) -> ObjectHead:
        return self.inner.head(key)

    def stream(self, key: str) -> Iterator[bytes]:
        if self._next() is StoreFault.FAILED:
            raise StoreUnavailable(f"{key}: failed")
        yield from self.inner.stream(key)

    def delete(self, keys: Sequence[str]) -> None:
        if not keys:
            return
        fault = self._next()
        if fault is not StoreFault.FAILED:
            self.version += 1
            self.inner.delete(keys[: len(keys) // 2] if fault is StoreFault.CUT else keys)
        if fault is not StoreFault.NONE:
            raise StoreUnavailable(f"delete: {fault.value}")

    def list(self, prefix: str) -> Iterator[ObjectEntry]:
        if self._next() is StoreFault.FAILED:
            raise StoreUnavailable(f"{prefix}: failed")
        return self.inner.list(prefix)

    def remove_unfinished(self, grace_s: float) -> int:
        return self.inner.remove_unfinished(grace_s)

    def _overwrite(self, key: str, data: bytes) -> None:
        self.version += 1
        self.inner.put(key, data, digest(data))

    def _next(self) -> StoreFault:
        return self.faults.pop(0) if self.faults else StoreFault.NONE


class BrokerFault(StrEnum):
    """How a message may be sent."""

    NONE = "none"
    FAILED = "failed"
    LANDED = "landed"
    """It arrives, and the sender is told that it does not."""
    DOUBLED = "doubled"


@dataclass
class FaultyDoorbell(MemoryDoorbell):
    """A doorbell that loses and doubles messages as `fault` says."""

    fault: BrokerFault = BrokerFault.NONE

    def __post_init__(self) -> None:
        super().__init__()

    def ring(self, shard_ids: Sequence[UUID]) -> None:
        if self.fault is BrokerFault.FAILED:
            raise BrokerUnavailable
        for _ in range(2 if self.fault is BrokerFault.DOUBLED else 1):
            super().ring(shard_ids)
        if self.fault is BrokerFault.LANDED:
            raise BrokerUnavailable
