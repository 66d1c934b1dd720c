"""The port: what hi5 asks of any object store."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Protocol

from hi5_common.storage import errors

_KEY = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*(/[A-Za-z0-9_-][A-Za-z0-9._-]*)*")

Heed = Callable[[], None]
"""Called again and again while bytes move; what it raises abandons the operation."""


def unheeding() -> None:
    """Let an operation take its time."""


@dataclass(frozen=True)
class ObjectHead:
    """What is known of an object without reading it."""

    size_bytes: int


@dataclass(frozen=True)
class ObjectEntry:
    """One line of a listing."""

    key: str
    size_bytes: int
    modified_at: datetime


class ObjectStore(Protocol):
    """Immutable objects by key.

    Every method raises StoreUnavailable when trying again may help, StoreRefused when the
    credentials are wrong, InvalidKey for a key that hi5 would never make.
    """

    def put(self, key: str, source: Path | bytes, sha256: str, heed: Heed = unheeding) -> None:
        """Store the bytes of a file, whole or not at all; then they survive a loss of power.

        Raises WrongBytes if the source does not have this SHA-256 (hex), and what `heed` raises:
        nothing more is then sent.
        """
        ...

    def get(self, key: str) -> bytes:
        """Return the whole object. Raises ObjectMissing."""
        ...

    def get_range(self, key: str, start: int, stop: int) -> bytes:
        """Return bytes [start, stop), fewer if the object ends earlier. Raises ObjectMissing."""
        ...

    def head(self, key: str) -> ObjectHead:
        """Return the size. Raises ObjectMissing."""
        ...

    def stream(self, key: str) -> Iterator[bytes]:
        """Yield the object in pieces of some megabytes. Raises ObjectMissing."""
        ...

    def delete(self, keys: Sequence[str]) -> None:
        """Remove objects; a key without an object is no error."""
        ...

    def list(self, prefix: str) -> Iterator[ObjectEntry]:
        """Yield the objects below a folder, in no order. For sweeping only: readers follow rows."""
        ...

    def remove_unfinished(self, grace_s: float) -> int:
        """Remove what dead writers left half-written; return how many pieces.

        Nothing that was written to within the last `grace_s` seconds is touched. A store that
        keeps such pieces where hi5 cannot see them removes none.
        """
        ...


def checked_key(key: str) -> str:
    """Return the key if it can mean only one thing on every store; raise InvalidKey otherwise."""
    if _KEY.fullmatch(key) is None or len(key) > 500:
        raise errors.InvalidKey(f"{key!r}: {errors.InvalidKey.__doc__}")
    return key
