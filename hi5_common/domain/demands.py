"""The combinations that a spec demands: how they link attributes, and what is wrong with them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hi5_common.domain.errors import Problem
from hi5_common.domain.planning.bundle import Bundle
from hi5_common.domain.planning.linked import Demand, Linked, links, relative
from hi5_common.domain.planning.strand import Strand
from hi5_common.domain.vocabulary import Attribute

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

MOST_CELLS = 5_000
"""Combinations of the attributes that a spec's demands link, at most."""


@dataclass(frozen=True)
class Group:
    """Attributes that demands link, and the demands' numbers in the spec."""

    attributes: tuple[Attribute, ...]
    numbers: tuple[int, ...]
    linked: Linked


def are_tied(spec: "DatasetSpec", a: Attribute, b: Attribute) -> bool:
    """Tell whether demands link two attributes: their pairs are then as the demands have them."""
    attributes = spec.balanced()
    named = [
        Demand({attributes.index(name): frozenset() for name in combination.of}, 0)
        for combination in spec.combinations
    ]
    return any(
        {attributes.index(a), attributes.index(b)} <= set(places) for places, _ in links(named)
    )


def groups(spec: "DatasetSpec", values: Mapping[Attribute, Sequence[str]]) -> list[Group]:
    """Return the groups of attributes that demands link; values by number, as they are planned."""
    attributes = spec.balanced()
    demands = [
        Demand(
            {
                attributes.index(name): frozenset(values[name].index(value) for value in listed)
                for name, listed in combination.of.items()
            },
            combination.count,
        )
        for combination in spec.combinations
    ]
    found = []
    for places, numbers in links(demands):
        names = tuple(attributes[place] for place in places)
        linked = Linked(
            tuple(strand_of(spec, name, values[name]) for name in names),
            tuple(relative(demands[number], places) for number in numbers),
            spec.count,
        )
        found.append(Group(names, tuple(numbers), linked))
    return found


def strand_of(spec: "DatasetSpec", attribute: Attribute, values: Sequence[str]) -> Strand:
    """Return an attribute's request by value numbers."""
    counts = spec.counts_of(attribute)
    if counts is None:
        return Strand(len(values))
    return Strand(len(values), np.array([counts[value] for value in values], dtype=np.int64))


def bundles(
    spec: "DatasetSpec", values: Mapping[Attribute, Sequence[str]], rng: np.random.Generator
) -> list[Bundle]:
    """Return how many images each combination of linked attributes gets, places as balanced()."""
    attributes, found = spec.balanced(), []
    for group in groups(spec, values):
        counts = group.linked.solved(rng)
        if counts is None:
            raise ValueError("the spec's demands clash: it was not checked")
        places = tuple(attributes.index(name) for name in group.attributes)
        found.append(Bundle(places, group.linked.combinations, counts))
    return found


def problems(spec: "DatasetSpec") -> list[Problem]:
    """List what is wrong with the combinations of a spec whose attributes are right."""
    found = [
        problem
        for number, combination in enumerate(spec.combinations)
        for problem in _misnamed(spec, number, combination.of)
    ]
    if found:
        return found
    values = {attribute: spec.values_of(attribute) for attribute in Attribute}
    for group in groups(spec, values):
        cells = math.prod(strand.size for strand in group.linked.strands)
        if cells > MOST_CELLS:
            names = ", ".join(attribute.value for attribute in group.attributes)
            remedy = f"They link {names}, which have {cells:,} combinations, over {MOST_CELLS:,}."
            found.append(Problem("combinations", names, f"{remedy} Ask for fewer values."))
        else:
            found += _clashes(spec, group)
    return found


def _misnamed(
    spec: "DatasetSpec", number: int, asked: Mapping[Attribute, Sequence[str]]
) -> list[Problem]:
    field = f"combinations.{number}.of"
    if len(asked) < 2:
        remedy = "Name two attributes or more; one alone has its counts under attributes."
        return [Problem(field, ", ".join(asked), remedy)]
    found = []
    for attribute, listed in asked.items():
        known = spec.values_of(attribute)
        if attribute not in spec.balanced():
            remedy = f"Every image has {known[0]}: ask for more values under attributes first."
            found.append(Problem(f"{field}.{attribute.value}", listed, remedy))
        elif not listed:
            found.append(Problem(f"{field}.{attribute.value}", listed, "Name at least one value."))
        for value in listed:
            if attribute in spec.balanced() and value not in known:
                remedy = f"The dataset has no such value: it has {', '.join(known[:50])}."
                found.append(Problem(f"{field}.{attribute.value}", value, remedy))
    return found


@lru_cache(maxsize=64)
def _clash(linked: Linked) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the demands that clash, and the nearest counts: kept, for specs are read often."""
    clash = linked.clash()
    if not clash:
        return (), ()
    nearest = linked.nearest()
    if nearest is None:
        raise ValueError("counts of attributes always go together")
    return clash, nearest


def _clashes(spec: "DatasetSpec", group: Group) -> list[Problem]:
    clash, nearest = _clash(group.linked)
    if not clash:
        return []
    numbers = [group.numbers[k] for k in clash]
    changes = [
        f"combinations.{number}.count: {wanted} instead of {spec.combinations[number].count}"
        for number, wanted in zip(group.numbers, nearest, strict=True)
        if wanted != spec.combinations[number].count
    ]
    words = ", ".join(f"combinations.{number}" for number in numbers)
    together = "cannot be met with" if len(numbers) == 1 else "cannot be met together with"
    remedy = (
        f"{words} {together} the counts of {', '.join(a.value for a in group.attributes)}. "
        f"The nearest that can be met: {'; '.join(changes)}."
    )
    shown = " and ".join(str(spec.combinations[number].count) for number in numbers)
    return [Problem(f"combinations.{numbers[0]}.count", shown, remedy)]
