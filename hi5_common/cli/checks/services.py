"""What the settings point to: database, broker, object store."""

from hi5_common.cli.checks.check import Check, CheckFailed
from hi5_common.settings import Settings


def service_checks(settings: Settings) -> tuple[Check, ...]:
    """Return what to look at with these settings."""
    return (
        Check("database", lambda: _database(settings), _DATABASE_REMEDY),
        Check("broker", lambda: _broker(settings), _BROKER_REMEDY),
        Check("object store", lambda: _store(settings), _STORE_REMEDY),
    )


_DATABASE_REMEDY = "Check HI5_DATABASE_URL, then run `hi5 migrate` (`hi5 up` does it itself)."
_BROKER_REMEDY = "Check HI5_BROKER_URL, or unset it: `hi5 up` brings a broker of its own."
_STORE_REMEDY = "Check HI5_STORE_URL and, for S3, endpoint, keys and bucket."


def _database(settings: Settings) -> str:
    from hi5_common.db import migrate
    from hi5_common.db.engine import normalized

    url = settings.resolved_database_url
    shown = normalized(url).render_as_string(hide_password=True)
    if url.startswith("sqlite") and not _sqlite_file_exists(url):
        return f"{shown}: not there yet; `hi5 up` or `hi5 migrate` makes it"
    current, head = migrate.current(url), migrate.head()
    if current != head:
        raise CheckFailed(f"{shown}: at revision {current or 'none'}, this hi5 needs {head}")
    return f"{shown}: revision {current}"


def _sqlite_file_exists(url: str) -> bool:
    from pathlib import Path

    return Path(url.split(":///", 1)[1]).exists()


def _broker(settings: Settings) -> str:
    import redis

    if "broker_url" not in settings.model_fields_set:
        return "HI5_BROKER_URL is not set: `hi5 up` brings a broker of its own"

    client = redis.Redis.from_url(settings.broker_url, socket_timeout=5, socket_connect_timeout=5)
    try:
        version = client.info("server").get("redis_version", "unknown")
    finally:
        client.close()
    return f"version {version}"


def _store(settings: Settings) -> str:
    from hi5_common.storage.probe import probe_settings

    return probe_settings(settings)
