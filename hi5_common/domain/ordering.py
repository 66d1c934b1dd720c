"""From a spec to its order: values by number, and orders put together out of others."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hi5_common.domain import coverage, splits, twins
from hi5_common.domain.clashes import linkable
from hi5_common.domain.demands import bundles, groups, strand_of
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.planning.joined import Interleaved, Renumbered, Twinned
from hi5_common.domain.planning.order import Order, grown, order_of
from hi5_common.domain.planning.sizes import value_sizes
from hi5_common.domain.planning.strand import Ints, Strand, Table
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.vocabulary import Attribute

ORDERED_BY = {
    "seed",
    "count",
    "attributes",
    "combinations",
    "conditional",
    "coverage",
    "twins",
    "splits",
    "extends",
    "commercial_safe",
}
"""The fields of a spec that an order depends on: the last by what is left of the defaults."""

Values = Mapping[Attribute, tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class Numbered:
    """An order, and what its numbers mean: of each attribute in `crossed`, a place in `values`."""

    values: Values
    crossed: tuple[Attribute, ...]
    order: Order


def numbered(spec: DatasetSpec) -> Numbered:
    """Return the order of a spec's images. The same spec gives the same everywhere."""
    return _numbered(json.dumps(_ordered_by(spec), sort_keys=True))


def _ordered_by(spec: DatasetSpec) -> dict[str, object]:
    """Return what of a spec, and of those that it extends, an order depends on."""
    document: dict[str, object] = spec.model_dump(mode="json", include=ORDERED_BY - {"extends"})
    if spec.extends is not None:
        document["extends"] = _ordered_by(spec.extends)
    return document


@lru_cache(maxsize=2)  # each up to 12 MB; what another is made from is the second
def _numbered(ordered_by: str) -> Numbered:
    spec = DatasetSpec.model_validate_json(ordered_by)
    values = {attribute: _values(spec, attribute) for attribute in Attribute}
    crossed = spec.balanced()
    if spec.twins:
        return Numbered(values, crossed, _of_twins(spec, values, crossed))
    if spec.splits:
        return Numbered(values, crossed, _of_splits(spec, values, crossed))
    if spec.extends:
        rng = factor_rng(spec.seed, 0, "plan/order")
        earlier = _earlier(spec.extends, values, crossed)
        later = [
            _more(strand_of(spec, name, values[name]), earlier[:, place], spec.count)
            for place, name in enumerate(crossed)
        ]
        return Numbered(values, crossed, grown(earlier, later, rng))
    return Numbered(values, crossed, _woven(spec, values, crossed))


def _woven(spec: DatasetSpec, values: Values, crossed: tuple[Attribute, ...]) -> Order:
    """Weave images; where coverage falls short, again with what it is of as a bundle."""
    strands = [strand_of(spec, name, values[name]) for name in crossed]
    linked = frozenset[int]()
    while True:
        tied = bundles(spec, values, factor_rng(spec.seed, 0, "plan/combinations"), linked)
        rng = factor_rng(spec.seed, 0, "plan/order")
        order = order_of(strands, spec.count, rng, tied)
        short = coverage.short(spec, order, crossed)
        if not short:
            return order
        linked |= short
        if not all(map(linkable, groups(spec, values, linked))):
            raise InvalidInput([coverage.short_of(spec, min(short), order, crossed)])


def _of_twins(spec: DatasetSpec, values: Values, crossed: tuple[Attribute, ...]) -> Order:
    others = tuple(name for name in crossed if name not in spec.twins)
    scenes = _renumbered(numbered(twins.scenes_of(spec)), values, others)
    numbers = [
        [values[name].index(value) for name, value in twin.items()]
        for twin in twins.each_of_scene(spec)
    ]
    places = tuple(crossed.index(name) for name in spec.twinned())
    sizes = tuple(len(values[name]) for name in crossed)
    return Twinned(scenes, places, np.array(numbers, dtype=np.uint16), sizes)


def _of_splits(spec: DatasetSpec, values: Values, crossed: tuple[Attribute, ...]) -> Order:
    parts = splits.parts(spec)
    orders = tuple(_renumbered(numbered(part), values, crossed) for part in parts.values())
    stages, size = list[tuple[int, ...]](), tuple(len(values[name]) for name in crossed)
    generation: DatasetSpec | None = spec
    while generation is not None:
        stages.append(tuple(part.count for part in splits.parts(generation).values()))
        generation = generation.extends
    return Interleaved(orders, tuple(reversed(stages)), size)


def _renumbered(source: Numbered, values: Values, crossed: tuple[Attribute, ...]) -> Order:
    """Return an order with the numbers of `values`, of the attributes in `crossed`.

    Values that are not among them have no images, and any number.
    """
    columns = []
    for name in crossed:
        known = {value: number for number, value in enumerate(values[name])}
        new = np.array([known.get(value, 0) for value in source.values[name]], np.int64)
        columns.append((source.crossed.index(name) if name in source.crossed else None, new))
    return Renumbered(source.order, tuple(columns), tuple(len(values[name]) for name in crossed))


def _earlier(base: DatasetSpec, values: Values, crossed: tuple[Attribute, ...]) -> Table:
    """Return the images (count, strands) of a dataset that is extended, in the new numbers."""
    order = _renumbered(numbered(base), values, crossed)
    return order.rows(np.arange(base.count, dtype=np.int64))


def _more(strand: Strand, earlier: Table, count: int) -> Strand:
    """Return what comes after `earlier` (images,) so that `count` images are as a strand has it.

    Of equal shares those that have more images already keep them, then the first have one more.
    """
    came = np.bincount(earlier, minlength=strand.size).astype(np.int64)
    wanted = strand.counts
    if wanted is None:
        share, extra = divmod(count, strand.size)
        ahead = np.argsort(came <= share, kind="stable")[:extra]
        wanted = np.full(strand.size, share, dtype=np.int64)
        wanted[ahead] += 1
    return Strand(strand.size, wanted - came)


def value_counts(found: Numbered, attribute: Attribute, count: int) -> Ints:
    """Return how many of `count` images each value (n,) has."""
    if attribute not in found.crossed:
        return np.array([count], np.int64)
    return value_sizes(found.order, found.crossed.index(attribute))


def _values(spec: DatasetSpec, attribute: Attribute) -> tuple[str, ...]:
    """Return the values asked for; where shares are equal the seed decides who is first."""
    asked = spec.values_of(attribute)
    if spec.counts_of(attribute) is not None:
        return asked
    rng = factor_rng(spec.seed, 0, f"plan/{attribute.value}")
    return tuple(asked[i] for i in rng.permutation(len(asked)))
