"""The adapter over obstore: S3 and memory, and the reading half of a local folder."""

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import obstore
from obstore.exceptions import BaseError, PermissionDeniedError, UnauthenticatedError
from obstore.store import ObjectStore as AnyStore

from hi5_common.storage import errors
from hi5_common.storage.port import ObjectEntry, ObjectHead, checked_key

PIECE_BYTES = 4 << 20
PART_BYTES = 16 << 20


class ObstoreStore:
    """An ObjectStore over one of obstore's stores. Not safe to use across a fork."""

    def __init__(self, store: AnyStore) -> None:
        self._store = store

    def put(self, key: str, source: Path | bytes, sha256: str) -> None:
        """Send the bytes in one request, or in parts above PART_BYTES."""
        if digest(source) != sha256:
            raise errors.WrongBytes(f"{key}: the source does not have SHA-256 {sha256}.")
        with _translated(key):
            obstore.put(self._store, checked_key(key), source, chunk_size=PART_BYTES)

    def get(self, key: str) -> bytes:
        """Return the whole object."""
        with _translated(key):
            return bytes(obstore.get(self._store, checked_key(key)).bytes())

    def get_range(self, key: str, start: int, stop: int) -> bytes:
        """Return bytes [start, stop)."""
        if stop <= start:
            return b""
        size_bytes = self.head(key).size_bytes
        if start >= size_bytes:
            return b""
        with _translated(key):
            found = obstore.get_range(self._store, key, start=start, end=min(stop, size_bytes))
            return bytes(found)

    def head(self, key: str) -> ObjectHead:
        """Return the size."""
        with _translated(key):
            return ObjectHead(int(obstore.head(self._store, checked_key(key))["size"]))

    def stream(self, key: str) -> Iterator[bytes]:
        """Yield the object in pieces."""
        with _translated(key):
            found = obstore.get(self._store, checked_key(key))
            for piece in found.stream(min_chunk_size=PIECE_BYTES):
                yield bytes(piece)

    def delete(self, keys: Sequence[str]) -> None:
        """Remove objects."""
        for key in keys:
            try:
                with _translated(key):
                    obstore.delete(self._store, checked_key(key))
            except errors.ObjectMissing:
                continue

    def list(self, prefix: str) -> Iterator[ObjectEntry]:
        """Yield the objects below a folder."""
        with _translated(prefix):
            for page in obstore.list(self._store, checked_key(prefix), chunk_size=1000):
                for meta in page:
                    yield ObjectEntry(meta["path"], int(meta["size"]), meta["last_modified"])


def digest(source: Path | bytes) -> str:
    """Return the SHA-256 of a file or of bytes, in hex."""
    if isinstance(source, bytes):
        return hashlib.sha256(source).hexdigest()
    with source.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def _translated(key: str) -> Iterator[None]:
    try:
        yield
    except FileNotFoundError as error:
        raise errors.ObjectMissing(f"{key}: {errors.ObjectMissing.__doc__}") from error
    except (PermissionDeniedError, UnauthenticatedError) as error:
        raise errors.StoreRefused from error
    except (BaseError, OSError) as error:
        first_line = (str(error).splitlines() or [type(error).__name__])[0]
        raise errors.StoreUnavailable(f"{key}: {first_line}") from error
