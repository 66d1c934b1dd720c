"""Storing a file and making sure that it is there."""

import hashlib
import time
from pathlib import Path

from hi5_common.domain.records import StoredObject
from hi5_common.storage import errors
from hi5_common.storage.port import Heed, ObjectStore, unheeding

TRIES = 3
"""A store that lost, spoilt or refused a file is given it again: rendering again costs more."""
FIRST_PAUSE_S = 0.2


def publish(
    store: ObjectStore, key: str, path: Path, sha256: str, heed: Heed = unheeding
) -> StoredObject:
    """Store a file, read it back and compare; return what a row may now point to.

    heed: called before and while bytes move; what it raises abandons everything at once.

    Raises WrongBytes if what comes back is not what was sent, StoreUnavailable if nothing does,
    and what the store raises, each time after TRIES tries.
    """
    stored = StoredObject(key, path.stat().st_size, sha256)
    for number in range(1, TRIES + 1):
        heed()
        try:
            _store_and_verify(store, stored, path, heed)
        except (errors.StoreUnavailable, errors.WrongBytes):
            if number == TRIES:
                raise
            time.sleep(FIRST_PAUSE_S * 2 ** (number - 1))
        else:
            break
    return stored


def _store_and_verify(store: ObjectStore, stored: StoredObject, path: Path, heed: Heed) -> None:
    store.put(stored.key, path, stored.sha256, heed)
    try:
        verify(store, stored, heed)
    except errors.ObjectMissing as error:
        told = f"{stored.key}: it was stored, and now the store knows nothing of it."
        raise errors.StoreUnavailable(told) from error


def verify(store: ObjectStore, expected: StoredObject, heed: Heed = unheeding) -> None:
    """Read a stored object and raise WrongBytes if size or SHA-256 differ from the row."""
    hasher = hashlib.sha256()
    size_bytes = 0
    for piece in store.stream(expected.key):
        hasher.update(piece)
        size_bytes += len(piece)
        heed()
    if size_bytes != expected.size_bytes:
        raise errors.WrongBytes(f"{expected.key}: {size_bytes} bytes, not {expected.size_bytes}.")
    if hasher.hexdigest() != expected.sha256:
        raise errors.WrongBytes(
            f"{expected.key}: SHA-256 is {hasher.hexdigest()}, not {expected.sha256}."
        )
