"""Counting delivered images by attribute value and by pair of values."""

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import combinations

from hi5_common.domain.records import Tallies
from hi5_common.domain.vocabulary import Attribute

EMPTY = Tallies({}, {})


def value_key(attribute: Attribute, value: str) -> str:
    """Return the key of one value in `Tallies.values`."""
    return f"{attribute.value}={value}"


def pair_key(first: tuple[Attribute, str], second: tuple[Attribute, str]) -> str:
    """Return the key of a pair in `Tallies.pairs`; the first comes first in planning order."""
    return joined(value_key(*first), value_key(*second))


def joined(first_key: str, second_key: str) -> str:
    """Return the key of a pair of values from their own keys."""
    return f"{first_key}&{second_key}"


def tally(cells: Iterable[Mapping[Attribute, str]], crossed: Iterable[Attribute]) -> Tallies:
    """Count the values of a number of images, and the pairs of values of the crossed attributes."""
    among = frozenset(crossed)
    values: Counter[str] = Counter()
    pairs: Counter[str] = Counter()
    for cell in cells:
        ordered = [(attribute, str(cell[attribute])) for attribute in Attribute]
        values.update(value_key(*item) for item in ordered)
        choices = [item for item in ordered if item[0] in among]
        pairs.update(pair_key(a, b) for a, b in combinations(choices, 2))
    return Tallies(dict(values), dict(pairs))


def add(*parts: Tallies) -> Tallies:
    """Add counts up."""
    values: Counter[str] = Counter()
    pairs: Counter[str] = Counter()
    for part in parts:
        values.update(part.values)
        pairs.update(part.pairs)
    return Tallies(dict(values), dict(pairs))
