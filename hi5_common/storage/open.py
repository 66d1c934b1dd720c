"""The store that the settings ask for."""

from pathlib import Path
from urllib.parse import unquote, urlsplit

from obstore.store import MemoryStore

from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.settings import Settings
from hi5_common.storage.local import LocalFolder
from hi5_common.storage.obstore_store import ObstoreStore
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.s3 import SignedReads, open_bucket, signed_reads


def open_store(settings: Settings) -> ObjectStore:
    """Open file:///folder or s3://bucket/prefix. Nothing is contacted until it is used."""
    url = settings.resolved_store_url
    parts = urlsplit(url)
    if parts.scheme == "file" and not parts.netloc and parts.path.startswith("/"):
        return LocalFolder(Path(unquote(parts.path)))
    if parts.scheme == "s3" and parts.netloc:
        return open_bucket(parts.netloc, parts.path.strip("/"), settings)
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
