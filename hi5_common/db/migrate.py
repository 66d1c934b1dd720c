"""Bring a database to a revision: `python -m hi5_common.db.migrate upgrade|downgrade|current`."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection, text

from hi5_common.db import errors, keys
from hi5_common.db.engine import make_write_ahead, open_database, reached
from hi5_common.db.keys import Granted
from hi5_common.domain.access import LOCAL_OWNER, Scope
from hi5_common.settings import Settings

ADMIN_NOTE = "HI5_ADMIN_KEY"
_LOCK = 7_435_001  # any fixed number: migrations of hi5 exclude each other


def upgrade(url: str, revision: str = "head") -> None:
    """Create or bring forward the tables. Safe to run from several processes at once."""
    _run(url, lambda config: command.upgrade(config, revision))


def downgrade(url: str, revision: str) -> None:
    """Take the tables back to a revision; "base" removes them with everything in them."""
    _run(url, lambda config: command.downgrade(config, revision))


def current(url: str) -> str | None:
    """Return the revision of a database, or None if it is empty."""
    database = open_database(url)
    try:
        with reached(), database.engine.connect() as connection:
            return MigrationContext.configure(connection).get_current_revision()
    finally:
        database.dispose()


def head() -> str | None:
    """Return the newest revision this version of hi5 knows."""
    return ScriptDirectory.from_config(_config()).get_current_head()


def register_admin(url: str, text: str | None) -> None:
    """Make the key of HI5_ADMIN_KEY known, if one is given; one that was revoked stays revoked.

    Raises InvalidInput for what is no key.
    """
    if text is None:
        return
    database = open_database(url)
    try:
        with database.transaction() as session:
            keys.register(session, text, Granted(LOCAL_OWNER, Scope.ADMIN, note=ADMIN_NOTE))
    finally:
        database.dispose()


def main(arguments: list[str]) -> int:
    """Run one command against HI5_DATABASE_URL."""
    parser = argparse.ArgumentParser(prog="hi5_common.db.migrate", description=__doc__)
    parser.add_argument("command", choices=("upgrade", "downgrade", "current"))
    parser.add_argument("revision", nargs="?")
    asked = parser.parse_args(arguments)
    settings = Settings()
    url = settings.resolved_database_url
    if asked.command == "upgrade":
        upgrade(url, asked.revision or "head")
        if asked.revision is None:
            register_admin(url, settings.admin_key)
    elif asked.command == "downgrade":
        downgrade(url, asked.revision or "-1")
    sys.stdout.write(f"{current(url) or 'empty'}\n")
    return 0


def _run(url: str, act: Callable[[Config], None]) -> None:
    database = open_database(url)
    try:
        with reached():
            make_write_ahead(database.engine)
            with database.engine.begin() as connection:
                _exclude_others(connection)
                with _known_revisions():
                    act(_config(connection))
    finally:
        database.dispose()


@contextmanager
def _known_revisions() -> Iterator[None]:
    try:
        yield
    except CommandError as error:
        raise errors.UnknownRevision(f"{errors.UnknownRevision.__doc__} ({error})") from error


def _exclude_others(connection: Connection) -> None:
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _LOCK})


def _config(connection: Connection | None = None) -> Config:
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations"))
    if connection is not None:
        config.attributes["connection"] = connection
    return config


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
