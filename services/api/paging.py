"""Cursors: a page knows the address of the next one."""

from urllib.parse import urlencode

from pydantic import BaseModel, ConfigDict, Field

MAX_LIMIT = 200


class StrictQuery(BaseModel):
    """Query parameters; an unknown one is a mistake, not noise."""

    model_config = ConfigDict(extra="forbid")


class Limited(StrictQuery):
    """How many entries a page may hold."""

    limit: int = Field(50, ge=1, le=MAX_LIMIT)


def next_address(path: str, limit: int, after: object, *, full: bool) -> str | None:
    """Return the address after a full page whose last entry is `after`; None on the last page."""
    return f"{path}?{urlencode({'limit': limit, 'after': str(after)})}" if full else None
