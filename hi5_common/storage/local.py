"""A folder as an object store that keeps its promises through a loss of power."""

import hashlib
import os
import time
import uuid
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from hi5_common.storage import errors, full_disk
from hi5_common.storage.port import Heed, ObjectEntry, ObjectHead, checked_key, unheeding

PIECE_BYTES = 4 << 20
UNFINISHED = ".unfinished"
"""The folder of objects being written: no key can begin so, and one look finds what is left."""
_REMEDY = "make room there, or name another place in HI5_STORE_URL."


class LocalFolder:
    """An ObjectStore in a folder: write under another name, fsync, rename, fsync the folder.

    obstore's own local store never calls fsync, so a row could outlive its object.
    """

    def __init__(self, root: Path) -> None:
        self._root = root

    def put(self, key: str, source: Path | bytes, sha256: str, heed: Heed = unheeding) -> None:
        """Store the bytes under a temporary name, then rename."""
        target = self._path(key)
        temporary = self._root / UNFINISHED / uuid.uuid4().hex
        try:
            _make_folder(temporary.parent)
            written = _write_durably(temporary, source, heed)
            if written != sha256:
                raise errors.WrongBytes(f"{key}: SHA-256 is {written}, not {sha256}.")
            _rename(temporary, target)
        except OSError as error:
            told = full_disk.told(error, self._root, _REMEDY)
            raise errors.StoreUnavailable(f"{key}: {told}") from error
        finally:
            with suppress(OSError):  # mostly gone already, renamed
                temporary.unlink()

    def get(self, key: str) -> bytes:
        """Return the whole object."""
        return b"".join(self.stream(key))

    def get_range(self, key: str, start: int, stop: int) -> bytes:
        """Return bytes [start, stop)."""
        try:
            with self._path(key).open("rb") as file:
                file.seek(start)
                return file.read(max(0, stop - start))
        except OSError as error:
            raise _translated(key, error) from error

    def head(self, key: str) -> ObjectHead:
        """Return the size."""
        try:
            return ObjectHead(self._path(key).stat().st_size)
        except OSError as error:
            raise _translated(key, error) from error

    def stream(self, key: str) -> Iterator[bytes]:
        """Yield the object in pieces."""
        try:
            with self._path(key).open("rb") as file:
                while piece := file.read(PIECE_BYTES):
                    yield piece
        except OSError as error:
            raise _translated(key, error) from error

    def delete(self, keys: Sequence[str]) -> None:
        """Remove objects, and the folders that this empties."""
        for key in keys:
            path = self._path(key)
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                raise _translated(key, error) from error
            self._remove_empty(path.parent)

    def list(self, prefix: str) -> Iterator[ObjectEntry]:
        """Yield the objects below a folder."""
        for folder, _, names in os.walk(self._path(prefix)):
            for name in names:
                yield from self._entry(Path(folder, name))

    def remove_unfinished(self, grace_s: float) -> int:
        """Remove files of writers that a crash or a loss of power ended."""
        removed = 0
        try:
            for path in (self._root / UNFINISHED).iterdir():
                with suppress(FileNotFoundError):  # finished while we looked
                    if path.stat().st_mtime < time.time() - grace_s:
                        path.unlink()
                        removed += 1
        except FileNotFoundError:  # nothing was ever written
            return removed
        except OSError as error:
            raise errors.StoreUnavailable(f"{UNFINISHED}: {error}") from error
        return removed

    def _entry(self, path: Path) -> Iterator[ObjectEntry]:
        try:
            found = path.stat()
        except FileNotFoundError:  # deleted while we listed
            return
        key = path.relative_to(self._root).as_posix()
        yield ObjectEntry(key, found.st_size, datetime.fromtimestamp(found.st_mtime, UTC))

    def _path(self, key: str) -> Path:
        return self._root / checked_key(key)

    def _remove_empty(self, folder: Path) -> None:
        while folder != self._root:
            try:
                folder.rmdir()
            except OSError:  # not empty, or gone: both are fine
                return
            folder = folder.parent


def _translated(key: str, error: OSError) -> errors.ObjectMissing | errors.StoreUnavailable:
    if isinstance(error, FileNotFoundError | IsADirectoryError | NotADirectoryError):
        return errors.ObjectMissing(f"{key}: {errors.ObjectMissing.__doc__}")
    return errors.StoreUnavailable(f"{key}: {error}")


def _write_durably(path: Path, source: Path | bytes, heed: Heed) -> str:
    """Write and fsync; return the SHA-256 of what was written, in hex."""
    hasher = hashlib.sha256()
    with path.open("xb") as file:
        for piece in _pieces(source):
            heed()
            hasher.update(piece)
            file.write(piece)
        file.flush()
        os.fsync(file.fileno())
    return hasher.hexdigest()


def _rename(temporary: Path, target: Path) -> None:
    """Move a file to its place; once more when a deletion took the folder, empty as yet, away."""
    try:
        _make_folder(target.parent)
        temporary.replace(target)
    except FileNotFoundError:
        _make_folder(target.parent)
        temporary.replace(target)
    _sync_folder(target.parent)


def _pieces(source: Path | bytes) -> Iterator[bytes]:
    if isinstance(source, bytes):
        yield source
        return
    with source.open("rb") as file:
        while piece := file.read(PIECE_BYTES):
            yield piece


def _make_folder(folder: Path) -> None:
    """Create a folder and its parents, each made durable in the one above."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir(exist_ok=True)
        _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
