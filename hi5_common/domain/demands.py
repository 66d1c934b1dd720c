"""What a spec demands of values together: how it links attributes, and what comes of it.

Combinations, conditional shares and coverage are terms of one program for every group of attributes
that they link. Coverage links only where images as they are woven fall short of it.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hi5_common.domain.planning.bundle import Bundle
from hi5_common.domain.planning.linked import Linked, links
from hi5_common.domain.planning.strand import Strand
from hi5_common.domain.planning.terms import AtLeast, Conditional, Demand, Term
from hi5_common.domain.vocabulary import Attribute

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

MOST_CELLS = 5_000
"""Combinations of the attributes that a spec's conditions link, at most."""

Values = Mapping[Attribute, Sequence[str]]
"""The values of every attribute, by number, as they are planned."""


@dataclass(frozen=True)
class Named:
    """A condition of a spec: its field, its place there, and what it asks for."""

    field: str
    number: int
    term: Term

    def __str__(self) -> str:
        return f"{self.field}.{self.number}"


@dataclass(frozen=True)
class Group:
    """Attributes that conditions link."""

    attributes: tuple[Attribute, ...]
    conditions: tuple[Named, ...]
    linked: Linked


def are_tied(spec: "DatasetSpec", a: Attribute, b: Attribute) -> bool:
    """Tell whether conditions link two attributes: their pairs are then as these have them."""
    named = [{*combination.of} for combination in spec.combinations]
    named += [{*conditional.given, conditional.of} for conditional in spec.conditional]
    attributes = spec.balanced()
    places = [{attributes.index(name) for name in names} for names in named]
    two = {attributes.index(a), attributes.index(b)}
    return any(two <= set(group) for group, _ in links(places))


def follows(spec: "DatasetSpec", attribute: Attribute) -> bool:
    """Tell whether an attribute that is left out has counts that follow from conditions."""
    asked = (conditional.of for conditional in spec.conditional)
    return spec.attributes[attribute] is None and attribute in asked


def expected_counts(spec: "DatasetSpec", attribute: Attribute) -> dict[str, float]:
    """Return the images of each value, of an attribute whose counts follow from conditions."""
    values = {name: spec.values_of(name) for name in Attribute}
    (group,) = (one for one in groups(spec, values) if attribute in one.attributes)
    column = group.linked.combinations[:, group.attributes.index(attribute)]
    images = np.bincount(column, weights=group.linked.expected, minlength=len(values[attribute]))
    return dict(zip(values[attribute], images.tolist(), strict=True))


def groups(spec: "DatasetSpec", values: Values, covered: Collection[int] = ()) -> list[Group]:
    """Return the groups of attributes that conditions link; covered: coverage that links too."""
    attributes = spec.balanced()
    conditions = _conditions(spec, values, covered)
    found = []
    for places, numbers in links([condition.term.places for condition in conditions]):
        names = tuple(attributes[place] for place in places)
        linked = Linked(
            tuple(strand_of(spec, name, values[name]) for name in names),
            tuple(conditions[number].term.at(places) for number in numbers),
            spec.count,
            frozenset(place for place, name in enumerate(names) if follows(spec, name)),
        )
        found.append(Group(names, tuple(conditions[number] for number in numbers), linked))
    return found


def _conditions(spec: "DatasetSpec", values: Values, covered: Collection[int]) -> list[Named]:
    attributes = spec.balanced()

    def places(listed: Mapping[Attribute, Sequence[str]]) -> dict[int, frozenset[int]]:
        return {
            attributes.index(name): frozenset(values[name].index(value) for value in some)
            for name, some in listed.items()
        }

    terms: dict[str, list[Term]] = {
        "combinations": [Demand(places(asked.of), asked.count) for asked in spec.combinations],
        "conditional": [
            Conditional(
                places(asked.given),
                attributes.index(asked.of),
                tuple(asked.share(value) for value in values[asked.of]),
            )
            for asked in spec.conditional
        ],
        "coverage": [
            AtLeast(
                tuple(attributes.index(name) for name in asked.of),
                tuple(len(values[name]) for name in asked.of),
                asked.at_least,
            )
            for asked in spec.coverage
        ],
    }
    return [
        Named(field, number, term)
        for field, found in terms.items()
        for number, term in enumerate(found)
        if field != "coverage" or number in covered
    ]


def strand_of(spec: "DatasetSpec", attribute: Attribute, values: Sequence[str]) -> Strand:
    """Return an attribute's request by value numbers."""
    counts = spec.counts_of(attribute)
    if counts is None:
        return Strand(len(values))
    return Strand(len(values), np.array([counts[value] for value in values], dtype=np.int64))


def bundles(
    spec: "DatasetSpec",
    values: Values,
    rng: np.random.Generator,
    covered: Collection[int] = (),
) -> list[Bundle]:
    """Return how many images each combination of linked attributes gets, places as balanced()."""
    attributes, found = spec.balanced(), []
    for group in groups(spec, values, covered):
        counts = group.linked.solved(rng)
        if counts is None:
            raise ValueError("the spec's demands clash: it was not checked")
        places = tuple(attributes.index(name) for name in group.attributes)
        found.append(Bundle(places, group.linked.combinations, counts))
    return found
