"""Time that stands still until a test moves it, in a real database with hi5's own statements."""

from datetime import UTC, datetime, timedelta
from typing import Any

from sqlalchemy import event, text

from hi5_common.db.engine import Database

BEGINNING = datetime(2027, 1, 1, tzinfo=UTC)

_POSTGRES = """
CREATE SCHEMA held;
CREATE TABLE held.present (moment timestamptz NOT NULL);
INSERT INTO held.present VALUES ('2027-01-01 00:00:00+00');
CREATE FUNCTION held.clock_timestamp() RETURNS timestamptz
    LANGUAGE sql VOLATILE AS 'SELECT moment FROM held.present';
"""
_SET = text("UPDATE held.present SET moment = :moment")


class VirtualTime:
    """The moment that a database's own clock shows.

    SQLite's strftime and Postgres's clock_timestamp are replaced by functions of the same name, so
    that every statement stays what it is in service.
    """

    def __init__(self, database: Database) -> None:
        self.moment = BEGINNING
        self._database = database
        self._is_sqlite = database.engine.dialect.name == "sqlite"
        if not self._is_sqlite:
            with database.transaction() as session:
                for statement in _POSTGRES.strip().split(";\n"):
                    session.execute(text(statement.removesuffix(";")))
        database.engine.dispose()
        event.listen(database.engine, "connect", self._prepare)

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        self._set(self.moment + timedelta(seconds=seconds))

    def begin_again(self) -> None:
        """Go back to the beginning: the same steps then find the same times."""
        self._set(BEGINNING)

    def seconds(self) -> float:
        """Return how much time has passed since the beginning."""
        return (self.moment - BEGINNING).total_seconds()

    def _set(self, moment: datetime) -> None:
        self.moment = moment
        if not self._is_sqlite:
            with self._database.engine.begin() as connection:
                connection.execute(_SET, {"moment": moment})

    def _prepare(self, connection: Any, _record: object) -> None:
        if self._is_sqlite:
            connection.create_function("strftime", 3, self._strftime)
            connection.execute("PRAGMA synchronous = OFF")  # the machine keeps its power
        else:
            connection.execute("SET search_path = held, pg_catalog, public")
            connection.commit()

    def _strftime(self, style: str, when: str, modifier: str) -> str:
        assert (style, when) == ("%Y-%m-%d %H:%M:%f", "now")
        seconds, unit = modifier.split()
        assert unit == "seconds"
        moment = self.moment + timedelta(seconds=float(seconds))
        return moment.replace(tzinfo=None).isoformat(" ", "milliseconds")
