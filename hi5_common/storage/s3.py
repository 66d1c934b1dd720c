"""An S3 bucket, of Amazon or of anybody who speaks its language."""

from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING

import obstore
from obstore.store import S3Store

from hi5_common.settings import Settings
from hi5_common.storage.obstore_store import ObstoreStore
from hi5_common.storage.port import checked_key

if TYPE_CHECKING:
    from obstore.store import S3Config

# Together shorter than a lease: an upload cannot outlive its lease unnoticed.
RETRY_TIMEOUT = timedelta(seconds=40)
REQUEST_TIMEOUT = timedelta(seconds=60)
MAX_RETRIES = 5


def open_bucket(bucket: str, prefix: str, settings: Settings) -> ObstoreStore:
    """Return a store in a bucket that exists. The server checks the SHA-256 of every upload."""
    return ObstoreStore(_bucket(bucket, prefix, settings, settings.s3_endpoint))


@dataclass(frozen=True)
class SignedReads:
    """Addresses at which one object can be read, for some minutes, without credentials."""

    store: S3Store
    lifetime: timedelta

    def url(self, key: str) -> str:
        """Return an address for GET of this key alone. Contacts nobody; raises InvalidKey."""
        return str(obstore.sign(self.store, "GET", checked_key(key), self.lifetime))


def signed_reads(bucket: str, prefix: str, settings: Settings) -> SignedReads:
    """Return what signs reads of a bucket, as clients reach it: settings.s3_public_endpoint."""
    store = _bucket(bucket, prefix, settings, settings.s3_public_endpoint)
    return SignedReads(store, timedelta(seconds=settings.signed_url_s))


def _bucket(bucket: str, prefix: str, settings: Settings, endpoint: str | None) -> S3Store:
    config: S3Config = {
        "region": settings.s3_region,
        "checksum_algorithm": "SHA256",
        "virtual_hosted_style_request": False,
    }
    if endpoint:
        config["endpoint"] = endpoint
    if settings.s3_access_key_id and settings.s3_secret_access_key:
        config["access_key_id"] = settings.s3_access_key_id
        config["secret_access_key"] = settings.s3_secret_access_key
    return S3Store(
        bucket,
        prefix=prefix or None,
        config=config,
        client_options={
            "timeout": REQUEST_TIMEOUT,
            "connect_timeout": timedelta(seconds=5),
            "allow_http": settings.s3_allow_http,
        },
        retry_config={"max_retries": MAX_RETRIES, "retry_timeout": RETRY_TIMEOUT},
    )
