"""Demands, and which attributes they link."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hi5_common.domain.vocabulary import Attribute


@dataclass(frozen=True)
class Demand:
    """So many images shall have, of every attribute named, one of the values listed."""

    of: Mapping[Attribute, tuple[str, ...]]
    count: int


def linked(demands: Sequence[Demand]) -> list[tuple[list[Attribute], list[int]]]:
    """Return the attributes that demands link with each other, and the numbers of those demands."""
    label = {name: name for demand in demands for name in demand.of}
    for demand in demands:
        first, *others = (label[name] for name in demand.of)
        label = {name: first if group in others else group for name, group in label.items()}
    found = []
    for group in dict.fromkeys(label.values()):
        names = [name for name in Attribute if label.get(name) == group]
        numbers = [n for n, demand in enumerate(demands) if label[next(iter(demand.of))] == group]
        found.append((names, numbers))
    return found
