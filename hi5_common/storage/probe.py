"""Whether a store does what hi5 asks of it, tried on one small object."""

import hashlib
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from hi5_common.domain.errors import Hi5Error, TransientError
from hi5_common.settings import Settings
from hi5_common.storage import errors
from hi5_common.storage.open import open_store
from hi5_common.storage.port import ObjectStore

FOLDER = "probes"
PATIENCE_S = 4.0
"""One request of a probe ends within so many seconds; the first that fails ends the probe."""


class StoreUnfit(TransientError):
    """The object store does not do what hi5 needs."""


def probe_settings(settings: Settings) -> str:
    """Try the store that the settings ask for; return what was found, in words.

    Raises StoreUnfit, which names the step that failed and the trouble.
    """
    probe(open_store(settings, PATIENCE_S))
    return f"{settings.resolved_store_url}: put, get, head, range, list and delete work"


def probe(store: ObjectStore) -> None:
    """Write, read in every way, and remove a small object; then wrong bytes must be refused.

    Raises StoreUnfit. What it could not remove lies below FOLDER and is no danger.
    """
    folder = f"{FOLDER}/{uuid.uuid4().hex}"
    key, content = f"{folder}/object", uuid.uuid4().bytes * 64
    with _step("put"):
        store.put(key, content, hashlib.sha256(content).hexdigest())
    try:
        _use(store, folder, key, content)
    except StoreUnfit:
        with suppress(Hi5Error):
            store.delete([key, f"{folder}/wrong"])
        raise


def _use(store: ObjectStore, folder: str, key: str, content: bytes) -> None:
    with _step("head"):
        _same("size in bytes", store.head(key).size_bytes, len(content))
    with _step("get"):
        _same("bytes", _short(store.get(key)), _short(content))
    with _step("range"):
        _same("bytes 10 to 20", store.get_range(key, 10, 20), content[10:20])
    with _step("list"):
        _same("keys", [entry.key for entry in store.list(folder)], [key])
    with _step("refusal of wrong bytes"):
        _refuses(store, f"{folder}/wrong", content)
    with _step("delete"):
        store.delete([key])
        _same("keys", [entry.key for entry in store.list(folder)], [])
        _is_missing(store, key)


def _short(content: bytes) -> str:
    return f"{len(content)} with SHA-256 {hashlib.sha256(content).hexdigest()}"


@contextmanager
def _step(name: str) -> Iterator[None]:
    try:
        yield
    except Hi5Error as error:
        raise StoreUnfit(f"{name}: {error}") from error


def _same(what: str, found: object, wanted: object) -> None:
    if found != wanted:
        raise StoreUnfit(f"{what}: {found!r} came back, not {wanted!r}.")


def _refuses(store: ObjectStore, key: str, content: bytes) -> None:
    try:
        store.put(key, content, hashlib.sha256(b"other bytes").hexdigest())
    except errors.WrongBytes:
        return _is_missing(store, key)
    raise StoreUnfit("an object was taken that does not have its SHA-256.")


def _is_missing(store: ObjectStore, key: str) -> None:
    try:
        store.head(key)
    except errors.ObjectMissing:
        return
    raise StoreUnfit(f"{key} should not be there, and is.")
