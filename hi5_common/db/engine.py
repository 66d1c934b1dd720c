"""A database to work with: SQLite in a file or Postgres, with the same promises."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import sqlalchemy
from sqlalchemy import Connection, Engine, event, exc
from sqlalchemy.engine import URL, make_url
from sqlalchemy.orm import Session as Session  # part of this module's interface
from sqlalchemy.pool import ConnectionPoolEntry

from hi5_common.db import errors
from hi5_common.domain.errors import InvalidInput, Problem

BUSY_TIMEOUT_MS = 10_000
LOOK_AGAIN_S = 0.02
_READ_ONLY = "hi5_read_only"
# No psycopg wait is without a limit: a lease outlives a hung connection, a worker must not.
_POSTGRES_OPTIONS = (
    "-c statement_timeout=15000 -c lock_timeout=10000 -c idle_in_transaction_session_timeout=30000"
)

_UNAVAILABLE = (
    exc.OperationalError,
    exc.InterfaceError,
    exc.TimeoutError,
    sqlite3.OperationalError,
)
_OUTDATED = ("no such table", "no such column", "does not exist")
_BROKEN = ("file is not a database", "malformed")


@dataclass(frozen=True)
class Database:
    """An engine and the two ways to use it."""

    engine: Engine

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """Yield a session that commits at the end of the block and rolls back on an error.

        On SQLite it takes the write lock at once. Objects read inside stay readable outside.
        Raises DatabaseUnavailable when trying again may help; whether the commit happened is
        then unknown, and every function of this package may be called again.
        """
        with (
            _translated(),
            Session(self.engine, expire_on_commit=False) as session,
            session.begin(),
        ):
            yield session

    @contextmanager
    def snapshot(self) -> Iterator[Session]:
        """Yield a session for reading only, which sees one moment however often it looks.

        It waits for no writer.
        """
        with (
            _translated(),
            self.engine.connect().execution_options(**_snapshot(self.engine)) as connection,
            Session(connection, expire_on_commit=False) as session,
        ):
            yield session

    def dispose(self) -> None:
        """Close every connection."""
        self.engine.dispose()


def open_database(url: str) -> Database:
    """Open a database whose tables exist (see migrate.upgrade). Nothing connects until used."""
    parsed = normalized(url)
    engine = _sqlite_engine(parsed) if _is_sqlite(parsed) else _postgres_engine(parsed)
    return Database(engine)


def normalized(url: str) -> URL:
    """Return the URL with the one driver we use for each database; refuse other databases."""
    try:
        parsed = make_url(url)
    except (exc.ArgumentError, ValueError) as error:
        raise _refused(url.partition(":")[0]) from error  # what follows may hold a password
    backend = parsed.get_backend_name()
    if backend == "sqlite" and parsed.database not in {None, "", ":memory:"}:
        return parsed.set(drivername="sqlite+pysqlite")
    if backend in {"postgresql", "postgres"}:
        return parsed.set(drivername="postgresql+psycopg")
    raise _refused(parsed.render_as_string(hide_password=True))


@contextmanager
def reached() -> Iterator[None]:
    """Say in words what goes wrong between us and the database, whatever is asked of it.

    Raises DatabaseUnavailable, DatabaseBroken.
    """
    try:
        yield
    except _UNAVAILABLE as error:
        raise errors.DatabaseUnavailable(_first_line(error)) from error
    except (exc.DatabaseError, sqlite3.DatabaseError) as error:
        if any(words in str(error) for words in _BROKEN):
            raise errors.DatabaseBroken from error
        raise


def make_write_ahead(engine: Engine) -> None:
    """Switch a new SQLite file to write-ahead logging, which it then remembers.

    Done once: setting the mode again on each connection takes exclusive locks. SQLite does not wait
    for those as it does for others, so that of several processes that switch at once all but one
    are told "locked": they look again until it is done.
    """
    if engine.dialect.name != "sqlite":
        return
    with engine.connect() as connection:
        raw = cast(sqlite3.Connection, connection.connection.driver_connection)
        give_up_s = time.monotonic() + BUSY_TIMEOUT_MS / 1000.0
        while not _is_write_ahead(raw):
            if time.monotonic() > give_up_s:
                raise sqlite3.OperationalError("database is locked")
            time.sleep(LOOK_AGAIN_S)


def _is_write_ahead(raw: sqlite3.Connection) -> bool:
    """Make it so if nobody is in the way; return whether it is."""
    try:
        if raw.execute("PRAGMA journal_mode").fetchone()[0] == "wal":
            return True
        return bool(raw.execute("PRAGMA journal_mode = WAL").fetchone()[0] == "wal")
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            return False
        raise


def _snapshot(engine: Engine) -> dict[str, Any]:
    if engine.dialect.name == "sqlite":
        return {_READ_ONLY: True}
    return {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}


def _is_sqlite(url: URL) -> bool:
    return url.get_backend_name() == "sqlite"


def _postgres_engine(url: URL) -> Engine:
    return sqlalchemy.create_engine(
        url,
        pool_pre_ping=True,
        pool_recycle=1800,
        pool_timeout=10,
        isolation_level="READ COMMITTED",
        connect_args={
            "connect_timeout": 5,
            "options": _POSTGRES_OPTIONS,
            "keepalives": 1,
            "keepalives_idle": 10,
            "keepalives_interval": 5,
            "keepalives_count": 3,
            "tcp_user_timeout": 30_000,
        },
    )


def _sqlite_engine(url: URL) -> Engine:
    Path(str(url.database)).parent.mkdir(parents=True, exist_ok=True)
    engine = sqlalchemy.create_engine(url, pool_timeout=10)
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _prepare_sqlite(connection: Any, _record: ConnectionPoolEntry) -> None:
    connection.isolation_level = None  # we write BEGIN ourselves
    for pragma in (
        f"busy_timeout = {BUSY_TIMEOUT_MS}",
        "synchronous = FULL",
        "foreign_keys = ON",
    ):
        connection.execute(f"PRAGMA {pragma}")


def _begin_sqlite(connection: Connection) -> None:
    # A transaction that reads first and writes later could otherwise fail half-way as "locked".
    read_only = connection.get_execution_options().get(_READ_ONLY, False)
    connection.exec_driver_sql("BEGIN" if read_only else "BEGIN IMMEDIATE")


@contextmanager
def _translated() -> Iterator[None]:
    with reached():
        try:
            yield
        except (exc.OperationalError, exc.ProgrammingError) as error:
            if any(words in str(error) for words in _OUTDATED):
                raise errors.DatabaseOutdated from error
            raise


def _refused(shown: str) -> InvalidInput:
    remedy = "Use sqlite:///<file> or postgresql://user:password@host:port/name."
    return InvalidInput([Problem("HI5_DATABASE_URL", shown, remedy)])


def _first_line(error: Exception) -> str:
    cause = getattr(error, "orig", None) or error
    return f"{errors.DatabaseUnavailable.__doc__} ({str(cause).splitlines()[0]})"
