"""Storing a file and making sure that it is there."""

import hashlib
from pathlib import Path

from hi5_common.domain.records import StoredObject
from hi5_common.storage import errors
from hi5_common.storage.port import ObjectStore


def publish(store: ObjectStore, key: str, path: Path, sha256: str) -> StoredObject:
    """Store a file, read it back and compare; return what a row may now point to.

    Raises WrongBytes if what comes back is not what was sent, and what the store raises.
    """
    size_bytes = path.stat().st_size
    store.put(key, path, sha256)
    stored = StoredObject(key, size_bytes, sha256)
    verify(store, stored)
    return stored


def verify(store: ObjectStore, expected: StoredObject) -> None:
    """Read a stored object and raise WrongBytes if size or SHA-256 differ from the row."""
    hasher = hashlib.sha256()
    size_bytes = 0
    for piece in store.stream(expected.key):
        hasher.update(piece)
        size_bytes += len(piece)
    if size_bytes != expected.size_bytes:
        raise errors.WrongBytes(f"{expected.key}: {size_bytes} bytes, not {expected.size_bytes}.")
    if hasher.hexdigest() != expected.sha256:
        raise errors.WrongBytes(
            f"{expected.key}: SHA-256 is {hasher.hexdigest()}, not {expected.sha256}."
        )
