"""The values a spec may give an attribute: how each is written, and in which order they come.

Most have names. A skin tone may also be a typology angle, a shape factor is a band or a number, and
an environment may be one that was fetched or is the user's own.
"""

import difflib
import itertools
import re
from collections.abc import Iterable
from typing import TypeGuard

from hi5_common.domain.bands import Band, number_text, parse_band
from hi5_common.domain.errors import shown
from hi5_common.domain.vocabulary import (
    ITA_RANGE_DEG,
    SHAPE_RANGES,
    VALUES,
    Attribute,
    skin_tone_ita_deg,
)

OWN_ENVIRONMENT = re.compile(
    r"polyhaven:[A-Za-z0-9][A-Za-z0-9_-]{0,99}|user:[A-Za-z0-9][A-Za-z0-9._-]{0,99}"
)
"""Environments outside the catalogue: a Poly Haven asset's id, or the name of a user's own file."""

_OWN = (
    " Or tag:<tag>, polyhaven:<id>, or user:<name>, in letters, digits, dots, hyphens and "
    "underscores."
)

MOST_LISTED = 50
"""Longer lists of known values are left to `hi5 vocabulary`."""

NUMBERED = frozenset({Attribute.SKIN_TONE, *SHAPE_RANGES})
"""Attributes whose values may be numbers."""


_LOOSE = r"[+-]?(?:\d+\.?\d*|\.\d+)"
_NEARLY_A_BAND = re.compile(
    rf"\s*({_LOOSE})\s*(?:-|–|—|…|:|,|to|\.{{2,3}})\s*({_LOOSE})\s*", re.ASCII
)


class UnknownValue(ValueError):
    """A value that an attribute cannot have; the message is the remedy."""


def may_be(attribute: Attribute, raw: object) -> TypeGuard[str | float]:
    """Tell whether something a user sent has the type of this attribute's values."""
    numbered = attribute in NUMBERED and isinstance(raw, int | float)
    return isinstance(raw, str) or (numbered and not isinstance(raw, bool))


def spelled(attribute: Attribute, raw: str | float) -> str:
    """Return the one spelling of a value, or of what cannot be one its own text."""
    found = _read(attribute, raw)
    if found is not None:
        return found
    return raw if isinstance(raw, str) else shown(raw)


def canonical_value(attribute: Attribute, raw: str | float) -> str:
    """Return the one spelling of a value: 41, 41.0 and "41.00" are all "41".

    Raises UnknownValue with a remedy.
    """
    found = _read(attribute, raw)
    if found is None:
        raise UnknownValue(_remedy(attribute, raw))
    return found


def in_words(attribute: Attribute, value: str) -> str:
    """Return a value as people write it: rocker front, ITA -40. Environments keep their ids."""
    if attribute is Attribute.ENVIRONMENT:
        return value
    if attribute is Attribute.SKIN_TONE and value not in VALUES[attribute]:
        return f"ITA {value}"
    return value.replace("_", " ")


def in_order(attribute: Attribute, values: Iterable[str]) -> list[str]:
    """Sort canonical values: named ones as the vocabulary has them, angles from light to dark,
    bands from low to high, environments of one's own after the catalogue, by name.
    """
    if attribute is Attribute.SKIN_TONE:
        return sorted(values, key=lambda value: -skin_tone_ita_deg(value))
    if attribute in SHAPE_RANGES:
        return sorted(values, key=parse_band)
    rank = {value: number for number, value in enumerate(VALUES[attribute])}
    return sorted(values, key=lambda value: (rank.get(value, len(rank)), value))


def _read(attribute: Attribute, raw: str | float) -> str | None:
    if raw in VALUES[attribute]:
        return str(raw)
    if attribute in NUMBERED:
        band = _band(raw)
        return str(band) if band is not None and _fits(attribute, band) else None
    if attribute is Attribute.ENVIRONMENT and isinstance(raw, str):
        return raw if OWN_ENVIRONMENT.fullmatch(raw) else None
    return None


def _band(raw: str | float) -> Band | None:
    try:
        return parse_band(raw if isinstance(raw, str) else number_text(float(raw)))
    except (OverflowError, ValueError):  # an integer too long for a float, a float not finite
        return None


def _fits(attribute: Attribute, band: Band) -> bool:
    if attribute is Attribute.SKIN_TONE:
        low, high = ITA_RANGE_DEG
        return low <= band.low == band.high <= high
    whole = SHAPE_RANGES[attribute]
    return whole.low <= band.low and band.high <= whole.high


def overlapping(attribute: Attribute, values: Iterable[str]) -> list[tuple[str, str]]:
    """List the neighbours among an attribute's values that can stand for the same hand.

    Skin tones with the same angle, and bands that share more than an end: bands that touch are
    apart, because a number drawn from a continuous band is its end with probability zero. A fixed
    value inside a band, its ends included, would be asked for twice.
    """
    ordered = in_order(attribute, values)
    pairs = list(itertools.pairwise(ordered))
    if attribute is Attribute.SKIN_TONE:
        return [(a, b) for a, b in pairs if skin_tone_ita_deg(a) == skin_tone_ita_deg(b)]
    if attribute not in SHAPE_RANGES:
        return []
    return [(a, b) for a, b in pairs if _share(parse_band(a), parse_band(b))]


def _share(a: Band, b: Band) -> bool:
    fixed = a.low == a.high or b.low == b.high
    return b.low <= a.high if fixed else b.low < a.high


def form(attribute: Attribute) -> str:
    """Say how the values of an attribute are written."""
    if attribute is Attribute.SKIN_TONE:
        low, high = map(number_text, ITA_RANGE_DEG)
        names = ", ".join(VALUES[attribute])
        return f"Name one of {names}, or a typology angle in degrees from {low} to {high}."
    if attribute in SHAPE_RANGES:
        whole = SHAPE_RANGES[attribute]
        low, high = number_text(whole.low), number_text(whole.high)
        return f"Write a number or a band low..high inside {low}..{high} ({whole.unit})."
    return "Every value is a name: a string."


def known(attribute: Attribute) -> str:
    """Name the values of an attribute, or where to find them."""
    if attribute in NUMBERED:
        return form(attribute)
    names = VALUES[attribute]
    own = _OWN if attribute is Attribute.ENVIRONMENT else ""
    if len(names) > MOST_LISTED:
        return f"`hi5 vocabulary` lists the {len(names)} known values.{own}"
    return f"Known values: {', '.join(names)}.{own}"


def _remedy(attribute: Attribute, raw: str | float) -> str:
    if not isinstance(raw, str):
        return known(attribute)
    if attribute in SHAPE_RANGES:
        return _meant(attribute, raw) + known(attribute)
    close = difflib.get_close_matches(raw, VALUES[attribute], n=1)
    return (f"Did you mean {close[0]}? " if close else "") + known(attribute)


def _meant(attribute: Attribute, text: str) -> str:
    """Guess the band behind another way to write one, or one that runs backwards."""
    match = _NEARLY_A_BAND.fullmatch(text)
    if match is None:
        return ""
    low, high = sorted(map(float, match.groups()))
    return f"Did you mean {Band(low, high)}? " if _fits(attribute, Band(low, high)) else ""
