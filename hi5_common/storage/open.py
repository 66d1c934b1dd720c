"""The store that the settings ask for."""

from pathlib import Path
from urllib.parse import unquote, urlsplit

from obstore.store import MemoryStore

from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.settings import Settings
from hi5_common.storage.local import LocalFolder
from hi5_common.storage.obstore_store import ObstoreStore
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.s3 import Patience, SignedReads, open_bucket, signed_reads


def open_store(settings: Settings, patience_s: float | None = None) -> ObjectStore:
    """Open file:///folder or s3://bucket/prefix. Nothing is contacted until it is used.

    patience_s: a request over a network ends within so many seconds, with all its retries. None
    is the time that a worker without renewal may hold its lease.
    """
    total_s = settings.lease_s - settings.fence_margin_s if patience_s is None else patience_s
    url = settings.resolved_store_url
    parts = urlsplit(url)
    if parts.scheme == "file" and not parts.netloc and parts.path.startswith("/"):
        return LocalFolder(Path(unquote(parts.path)))
    if parts.scheme == "s3" and parts.netloc:
        patience = Patience.within(total_s)
        return open_bucket(parts.netloc, parts.path.strip("/"), settings, patience)
    remedy = "Use file:///<absolute folder> or s3://<bucket>/<prefix>."
    raise InvalidInput([Problem("HI5_STORE_URL", url, remedy)])


def open_signed_reads(settings: Settings) -> SignedReads | None:
    """Return what signs addresses of objects, or None where clients cannot reach the store."""
    parts = urlsplit(settings.resolved_store_url)
    if settings.s3_public_endpoint is None:
        return None
    if parts.scheme != "s3" or not parts.netloc:
        remedy = "Only an S3 store has addresses of its own: leave it out, or use s3://<bucket>."
        raise InvalidInput([Problem("HI5_S3_PUBLIC_ENDPOINT", settings.s3_public_endpoint, remedy)])
    return signed_reads(parts.netloc, parts.path.strip("/"), settings)


def memory_store() -> ObjectStore:
    """Return a new store that forgets everything with its process: for tests."""
    return ObstoreStore(MemoryStore())
