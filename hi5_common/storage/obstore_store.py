"""The adapter over obstore: S3 and memory, and the reading half of a local folder."""

import asyncio
import hashlib
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import obstore
from obstore.exceptions import BaseError, PermissionDeniedError, UnauthenticatedError
from obstore.store import ObjectStore as AnyStore

from hi5_common.storage import errors
from hi5_common.storage.port import Heed, ObjectEntry, ObjectHead, checked_key, unheeding

# Every request moves at most so much, one after the other: the time-out of a request then asks for
# a slow link's speed, however large the object is. S3 takes no smaller parts than 5 MiB.
PIECE_BYTES = 4 << 20
PART_BYTES = 5 << 20
KEYS_AT_ONCE = 500
TICK_S = 0.25


class ObstoreStore:
    """An ObjectStore over one of obstore's stores. Not safe to use across a fork."""

    def __init__(self, store: AnyStore) -> None:
        self._store = store

    def put(self, key: str, source: Path | bytes, sha256: str, heed: Heed = unheeding) -> None:
        """Send the bytes in one request, or in parts above PART_BYTES."""
        if digest(source) != sha256:
            raise errors.WrongBytes(f"{key}: the source does not have SHA-256 {sha256}.")
        path = checked_key(key)
        with _translated(key):
            try:
                asyncio.run(_heeding(lambda: self._send(path, source), heed))
            except FileNotFoundError as error:  # of the bucket, or of a part: not of an object
                raise errors.StoreUnavailable(f"{key}: {_first_line(error)}") from error

    async def _send(self, path: str, source: Path | bytes) -> None:
        await obstore.put_async(self._store, path, source, chunk_size=PART_BYTES, max_concurrency=1)

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
        """Yield the object in pieces, each one a request with retries of its own.

        A request for the whole would have to end within a request's time, at its reader's speed.
        """
        size_bytes = self.head(key).size_bytes
        for start in range(0, size_bytes, PIECE_BYTES):
            with _translated(key):
                stop = min(start + PIECE_BYTES, size_bytes)
                piece = bytes(obstore.get_range(self._store, key, start=start, end=stop))
            yield piece

    def delete(self, keys: Sequence[str]) -> None:
        """Remove objects."""
        for start in range(0, len(keys), KEYS_AT_ONCE):
            some = [checked_key(key) for key in keys[start : start + KEYS_AT_ONCE]]
            with _translated(some[0]):
                try:
                    obstore.delete(self._store, some)
                except FileNotFoundError as error:  # of the bucket: objects may be missing
                    raise errors.StoreUnavailable(f"{some[0]}: {_first_line(error)}") from error

    def list(self, prefix: str) -> Iterator[ObjectEntry]:
        """Yield the objects below a folder."""
        with _translated(prefix):
            for page in obstore.list(self._store, checked_key(prefix), chunk_size=1000):
                for meta in page:
                    yield ObjectEntry(meta["path"], int(meta["size"]), meta["last_modified"])

    def remove_unfinished(self, grace_s: float) -> int:  # noqa: ARG002  part of the port
        """Remove nothing: parts of dead uploads are the business of the bucket's lifecycle."""
        return 0


async def _heeding(start: Callable[[], Awaitable[None]], heed: Heed) -> None:
    """Wait for an operation and heed meanwhile; what `heed` raises stops the operation."""
    task = asyncio.ensure_future(start())
    try:
        while not (await asyncio.wait((task,), timeout=TICK_S))[0]:
            heed()
    except BaseException:
        task.cancel()
        await asyncio.wait((task,))
        raise
    task.result()


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
        raise errors.StoreUnavailable(f"{key}: {_first_line(error)}") from error


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
