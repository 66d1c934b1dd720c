"""The values a spec may give an attribute: how each is written, and in which order they come.

Most have names. A skin tone may also be a typology angle, a shape factor is a band or a number, and
an environment may be one that was fetched or is the user's own.
"""

import difflib
import itertools
import re
from collections.abc import Iterable

from hi5_common.domain.bands import Band, number_text, parse_band
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

MOST_LISTED = 50
"""Longer lists of known values are left to `hi5 vocabulary`."""

NUMBERED = frozenset({Attribute.SKIN_TONE, *SHAPE_RANGES})
"""Attributes whose values may be numbers."""


class UnknownValue(ValueError):
    """A value that an attribute cannot have; the message is the remedy."""


def canonical_value(attribute: Attribute, raw: object) -> str:
    """Return the one spelling of a value: 41, 41.0 and "41.00" are all "41".

    Raises UnknownValue with a remedy.
    """
    if isinstance(raw, bool) or not isinstance(raw, str | int | float):
        raise UnknownValue(_form(attribute))
    if not isinstance(raw, str) and attribute not in NUMBERED:
        raise UnknownValue(_form(attribute))
    text = raw if isinstance(raw, str) else _number(attribute, raw)
    if text in VALUES[attribute]:
        return str(text)
    if attribute is Attribute.SKIN_TONE:
        return _typology_angle(text)
    if attribute in SHAPE_RANGES:
        return _shape_band(attribute, text)
    if attribute is Attribute.ENVIRONMENT and OWN_ENVIRONMENT.fullmatch(text):
        return text
    raise UnknownValue(_nearest(attribute, text) + _known(attribute))


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


def _number(attribute: Attribute, raw: float) -> str:
    """Return a number's text, or the remedy for one that is too long to be meant."""
    try:
        number = float(raw)
        return number_text(number)
    except (OverflowError, ValueError) as error:
        raise UnknownValue(_form(attribute)) from error


def _typology_angle(text: str) -> str:
    try:
        band = parse_band(text)
    except ValueError as error:
        raise UnknownValue(_nearest(Attribute.SKIN_TONE, text) + _form(Attribute.SKIN_TONE)) from (
            error
        )
    low, high = ITA_RANGE_DEG
    if band.low != band.high or not low <= band.low <= high:
        raise UnknownValue(_form(Attribute.SKIN_TONE))
    return str(band)


def _shape_band(attribute: Attribute, text: str) -> str:
    try:
        band = parse_band(text)
    except ValueError as error:
        raise UnknownValue(f"{str(error).capitalize()}. {_form(attribute)}") from error
    whole = SHAPE_RANGES[attribute].band
    if band.low < whole.low or band.high > whole.high:
        raise UnknownValue(_form(attribute))
    return str(band)


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


def _form(attribute: Attribute) -> str:
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


def _known(attribute: Attribute) -> str:
    known = VALUES[attribute]
    own = " Or polyhaven:<id>, or user:<name>." if attribute is Attribute.ENVIRONMENT else ""
    if len(known) > MOST_LISTED:
        return f"`hi5 vocabulary` lists the {len(known)} known values.{own}"
    return f"Known values: {', '.join(known)}.{own}"


def _nearest(attribute: Attribute, text: str) -> str:
    close = difflib.get_close_matches(text, VALUES[attribute], n=1)
    return f"Did you mean {close[0]}? " if close else ""
