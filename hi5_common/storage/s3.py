"""An S3 bucket, of Amazon or of anybody who speaks its language."""

from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING, Self

import obstore
from obstore.store import S3Store

from hi5_common.settings import Settings
from hi5_common.storage.obstore_store import ObstoreStore
from hi5_common.storage.port import checked_key

if TYPE_CHECKING:
    from obstore.store import S3Config

MAX_RETRIES = 100
"""More than there is time for: the time is the bound, whatever the store answers."""


@dataclass(frozen=True)
class Patience:
    """How long one request may take, in seconds.

    request_s: a single try, with its body. retry_s: so long after the first try there may be
    another. pause_s: the longest pause before one.
    """

    request_s: float
    retry_s: float
    pause_s: float

    @classmethod
    def within(cls, total_s: float) -> Self:
        """Return what makes a request end, with all its retries, in less than `total_s`.

        Another try fits in even when the first one is never answered.
        """
        return cls(request_s=0.4 * total_s, retry_s=0.5 * total_s, pause_s=0.05 * total_s)

    @property
    def longest_s(self) -> float:
        """The longest a request can take with all its retries."""
        return self.retry_s + self.pause_s + self.request_s


def open_bucket(bucket: str, prefix: str, settings: Settings, patience: Patience) -> ObstoreStore:
    """Return a store in a bucket that exists. The server checks the SHA-256 of every upload."""
    return ObstoreStore(_bucket(bucket, prefix, settings, settings.s3_endpoint, patience))


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
    patience = Patience.within(settings.lease_s)  # signing contacts nobody
    store = _bucket(bucket, prefix, settings, settings.s3_public_endpoint, patience)
    return SignedReads(store, timedelta(seconds=settings.signed_url_s))


def _bucket(
    bucket: str, prefix: str, settings: Settings, endpoint: str | None, patience: Patience
) -> S3Store:
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
    pause = timedelta(seconds=patience.pause_s)
    return S3Store(
        bucket,
        prefix=prefix or None,
        config=config,
        client_options={
            "timeout": timedelta(seconds=patience.request_s),
            "connect_timeout": timedelta(seconds=min(5.0, patience.request_s)),
            "allow_http": settings.s3_allow_http,
        },
        retry_config={
            "max_retries": MAX_RETRIES,
            "retry_timeout": timedelta(seconds=patience.retry_s),
            "backoff": {"init_backoff": min(pause, timedelta(seconds=0.1)), "max_backoff": pause},
        },
    )
