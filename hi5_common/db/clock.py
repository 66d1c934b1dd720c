"""Time as the database tells it: no process's own clock decides about a lease."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import DateTime, Dialect, TypeDecorator, literal
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.functions import FunctionElement


class UtcTime(TypeDecorator[datetime]):
    """An aware UTC time; SQLite keeps it as text that sorts by time."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        """Refuse a naive time: nobody knows what it means."""
        if value is not None and value.tzinfo is None:
            raise ValueError(f"{value!r} has no time zone")
        return None if value is None else value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        """Return the time with its zone."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class _NowPlus(FunctionElement[datetime]):
    """SQL for the present moment plus a number of seconds."""

    type = UtcTime()
    inherit_cache = True
    name = "now_plus"


def now_plus(seconds: float) -> FunctionElement[datetime]:
    """Return SQL for the database's present moment (not the transaction's start) plus seconds."""
    return _NowPlus(literal(float(seconds)))


def now() -> FunctionElement[datetime]:
    """Return SQL for the database's present moment."""
    return now_plus(0.0)


@compiles(_NowPlus, "postgresql")
def _postgresql(element: _NowPlus, compiler: SQLCompiler, **kw: Any) -> str:
    seconds = compiler.process(element.clauses, **kw)
    return f"(clock_timestamp() + CAST({seconds} AS double precision) * interval '1 second')"


@compiles(_NowPlus, "sqlite")
def _sqlite(element: _NowPlus, compiler: SQLCompiler, **kw: Any) -> str:
    # The text has the same width as the one SQLAlchemy writes, so that times compare as text.
    seconds = compiler.process(element.clauses, **kw)
    return f"(strftime('%Y-%m-%d %H:%M:%f', 'now', {seconds} || ' seconds') || '000')"
