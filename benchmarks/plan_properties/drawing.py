"""Random specs, each a function of its seed: of some there is a plan, of others there is none.

Two to six attributes have a choice, of a few values or of many, in equal shares, exact counts (some
of them skewed, with values of no images) or weights. Combinations are counted in a hidden table of
images, so that they can be met but are far from independent, or missed by a few, or made up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from benchmarks.plan_evenness import EVERYTHING
from benchmarks.plan_properties.linkage import Demand, linked
from benchmarks.plan_properties.wanted import Request, Wanted, Weights, middling, wanted
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import ALWAYS_BALANCED, DEFAULTS, VALUES, Attribute

Numbers = npt.NDArray[np.int64]

ANGLES = tuple(str(angle) for angle in range(-89, 70) if angle not in (55, 41, 28, 10, -30, -80))
POOLS: Mapping[Attribute, Sequence[str]] = {
    **{attribute: tuple(map(str, values)) for attribute, values in EVERYTHING.items()},
    **{attribute: VALUES[attribute] for attribute in ALWAYS_BALANCED},
    Attribute.SKIN_TONE: (*VALUES[Attribute.SKIN_TONE], *ANGLES),
}
"""Values that a spec may draw."""
MOST_CELLS = 1000
"""Combinations of the attributes that the demands of a spec link, at most."""
MOST_OF_A_ROW = 12
"""Demands of one value with each of another attribute's, at most."""


@dataclass(frozen=True)
class Drawn:
    """A spec as it is sent, and which of its attributes' counts were made wrong, if any."""

    seed: int
    count: int
    requests: Mapping[Attribute, Request]
    demands: tuple[Demand, ...] = ()
    wrong: Attribute | None = None

    def document(self) -> dict[str, object]:
        """Return what `parse_spec` takes."""
        return {
            "seed": self.seed,
            "count": self.count,
            "attributes": {
                name.value: {"weights": request.of} if isinstance(request, Weights) else request
                for name, request in self.requests.items()
            },
            "combinations": [
                {
                    "of": {name.value: list(listed) for name, listed in d.of.items()},
                    "count": d.count,
                }
                for d in self.demands
            ],
        }

    def wanted(self) -> dict[Attribute, Wanted]:
        """Return the fewest and the most images of every value, of attributes with a choice."""
        return {
            name: found
            for name, request in self.requests.items()
            if len(found := wanted(name, request, self.count)) > 1
        }


def drawn(seed: int) -> Drawn:
    """Return the spec of a seed."""
    rng = factor_rng(seed, 0, "benchmark/plan_properties")
    count = int(rng.integers(400, 3001)) if rng.random() < 0.06 else _small(rng)
    chosen = [list(Attribute)[n] for n in rng.permutation(len(Attribute))[: rng.integers(2, 7)]]
    requests: dict[Attribute, Request] = {
        name: [POOLS[name][rng.integers(len(POOLS[name]))]] for name in ALWAYS_BALANCED
    }
    requests |= {name: _request(rng, name, count) for name in chosen}
    spec = Drawn(seed, count, requests)
    if rng.random() < 0.04:
        return _miscounted(rng, spec)
    if rng.random() < 0.3:
        return spec
    return replace(spec, demands=_demands(rng, spec))


def _small(rng: np.random.Generator) -> int:
    return int(400 ** rng.random())


def _request(rng: np.random.Generator, attribute: Attribute, count: int) -> Request:
    """Return a list, exact counts or weights of some values; or None for what is the default."""
    pool, kind = POOLS[attribute], rng.integers(5)
    if kind == 0 and len(DEFAULTS[attribute]) > 1:
        return None
    most = len(pool) if rng.random() < 0.15 else min(len(pool), 5)
    values = [pool[n] for n in rng.permutation(len(pool))[: rng.integers(2, most + 1)]]
    if kind <= 1:
        return values
    shares = rng.dirichlet(np.full(len(values), rng.choice([0.15, 0.5, 1.0, 8.0])))
    if kind <= 3:
        return dict(zip(values, rng.multinomial(count, shares).tolist(), strict=True))
    weights = np.maximum(0.0, np.round(shares, 3))
    weights[int(np.argmax(shares))] += 0.001
    return Weights(dict(zip(values, weights.tolist(), strict=True)))


def _miscounted(rng: np.random.Generator, spec: Drawn) -> Drawn:
    """Return a spec with counts that do not add up, where there are any."""
    for name, request in spec.requests.items():
        if isinstance(request, dict):
            value = max(request, key=lambda value: request[value])
            off = int(rng.integers(1, 4))
            changed = {**request, value: max(0, request[value] + (off if spec.seed % 2 else -off))}
            return replace(spec, requests={**spec.requests, name: changed}, wrong=name)
    return spec


def _demands(rng: np.random.Generator, spec: Drawn) -> tuple[Demand, ...]:
    table = _hidden(rng, spec)
    if rng.random() < 0.15:
        return _row(rng, table)
    truthful = rng.random() < 0.4
    number = int(rng.choice([1, 2, 3, 4, 6, 12], p=[0.25, 0.25, 0.2, 0.15, 0.1, 0.05]))
    demands: list[Demand] = []
    for _ in range(number):
        demand = _demand(rng, table, truthful=truthful)
        groups = linked([*demands, demand])
        sizes = [np.prod([len(table[name][0]) for name in names]) for names, _ in groups]
        if max(sizes) <= MOST_CELLS:
            demands.append(demand)
    return tuple(demands)


Hidden = dict[Attribute, tuple[list[str], Numbers]]
"""Values of an attribute, and the number of the one that each image has."""


def _hidden(rng: np.random.Generator, spec: Drawn) -> Hidden:
    """Return images that have what the spec asks of each attribute alone, more or less in step."""
    together, step = rng.random(spec.count), rng.random() ** 2
    table = {}
    for name, found in spec.wanted().items():
        counts = middling(found, spec.count)
        values = np.repeat(np.arange(len(counts)), counts)
        order = np.argsort(step * together + (1 - step) * rng.random(spec.count))
        column = np.empty(spec.count, np.int64)
        column[order] = values
        table[name] = (list(found), column)
    return table


def _row(rng: np.random.Generator, table: Hidden) -> tuple[Demand, ...]:
    """Return demands for one value with each of another attribute's, which clash if one is wrong.

    All together: the others could be met.
    """
    (a, b) = (list(table)[n] for n in rng.permutation(len(table))[:2])
    (ours, column), (theirs, other) = table[a], table[b]
    x = column[rng.integers(len(column))]
    counts = np.bincount(other[column == x], minlength=len(theirs))
    counts[rng.integers(len(theirs))] += rng.integers(2)
    cells = len(ours) * len(theirs)
    return tuple(
        Demand({a: (ours[x],), b: (value,)}, int(n))
        for value, n in zip(theirs, counts, strict=True)
        if cells <= MOST_CELLS and len(theirs) <= MOST_OF_A_ROW
    )


def _demand(rng: np.random.Generator, table: Hidden, *, truthful: bool) -> Demand:
    names = list(table)
    several = min(len(names), int(rng.choice([2, 3], p=[0.8, 0.2])))
    chosen = [names[n] for n in rng.permutation(len(names))[:several]]
    of, has = {}, np.ones(len(table[names[0]][1]), bool)
    fewest = len(has)
    for name in chosen:
        values, column = table[name]
        listed = rng.permutation(len(values))[: rng.integers(1, max(2, len(values) // 2 + 1))]
        of[name] = tuple(values[n] for n in listed)
        mine = np.isin(column, listed)
        has &= mine
        fewest = min(fewest, int(mine.sum()))
    hidden = int(has.sum())
    if truthful:
        return Demand(of, hidden)
    made_up = (0, hidden, max(0, hidden + int(rng.integers(-3, 4))), int(rng.integers(fewest + 2)))
    return Demand(of, made_up[rng.integers(len(made_up))])
