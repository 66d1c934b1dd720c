"""A database for a test: every test that asks for `database` runs on SQLite and on Postgres."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from hi5_common.db import migrate
from hi5_common.db.engine import Database, open_database


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.integration)])
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Return the URL of an empty database, without tables."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'hi5.sqlite'}"
    return str(request.getfixturevalue("postgres_url"))


@pytest.fixture
def database(database_url: str) -> Iterator[Database]:
    """Yield a database with all tables."""
    migrate.upgrade(database_url)
    opened = open_database(database_url)
    yield opened
    opened.dispose()
