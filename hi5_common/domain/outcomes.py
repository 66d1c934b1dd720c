"""What comes of the conditional shares and the coverage that a spec asks for, in images."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hi5_common.domain.plan import Plan
from hi5_common.domain.planning.sizes import cell_sizes
from hi5_common.domain.vocabulary import Attribute


@dataclass(frozen=True)
class Shared:
    """Images by value of an attribute, among those with one of the values given of others."""

    given: Mapping[Attribute, Sequence[str]]
    of: Attribute
    images: Mapping[str, int]


@dataclass(frozen=True)
class Covered:
    """The images of the rarest and of the commonest combination of some attributes' values."""

    of: tuple[Attribute, ...]
    at_least: int
    smallest: int
    largest: int


def shared(plan: Plan) -> tuple[Shared, ...]:
    """Return what each of the spec's conditional shares comes to, in the order asked for."""
    found = []
    for asked in plan.spec.conditional:
        sizes = cell_sizes(plan.order, [plan.crossed.index(k) for k in (*asked.given, asked.of)])
        rows = [
            [plan.levels[name].values.index(value) for value in dict.fromkeys(listed)]
            for name, listed in asked.given.items()
        ]
        values = plan.levels[asked.of].values
        within = sizes[np.ix_(*rows, range(len(values)))].reshape(-1, len(values)).sum(axis=0)
        images = dict(zip(values, within.tolist(), strict=True))
        ordered = {value: images[value] for value in plan.spec.values_of(asked.of)}
        found.append(Shared(asked.given, asked.of, ordered))
    return tuple(found)


def covered(plan: Plan) -> tuple[Covered, ...]:
    """Return what each of the spec's coverage comes to, in the order asked for."""
    found = []
    for asked in plan.spec.coverage:
        sizes = cell_sizes(plan.order, [plan.crossed.index(name) for name in asked.of])
        smallest, largest = int(sizes.min()), int(sizes.max())
        found.append(Covered(tuple(asked.of), asked.at_least, smallest, largest))
    return tuple(found)
