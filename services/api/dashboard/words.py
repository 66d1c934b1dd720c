"""How numbers, names and times read on a page."""

import math
from datetime import UTC, datetime

from hi5_common.domain import values
from hi5_common.domain.vocabulary import Attribute


def label(name: str) -> str:
    """Return a vocabulary word as people write it."""
    return str(name).replace("_", " ")


def tone(value: str) -> str:
    """Return a skin tone as people write it, a number as its typology angle."""
    return values.in_words(Attribute.SKIN_TONE, str(value))


def number(value: float) -> str:
    """Return a count with thousands marked; a fraction keeps one decimal."""
    return f"{value:,.0f}" if float(value).is_integer() else f"{value:,.1f}"


def percent(share: float) -> str:
    """Return a share in percent, rounded down: 100 % means all of it."""
    return f"{math.floor(share * 1000) / 10:g}"


def moment(when: datetime) -> str:
    """Return a time as a date and minutes in UTC."""
    return when.astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC")
