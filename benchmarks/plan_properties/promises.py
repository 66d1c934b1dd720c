"""Whether the images of a plan are what its spec was promised: decisions 0054 and 0055."""

import hashlib
import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.plan_properties.drawing import Drawn
from benchmarks.plan_properties.linkage import Demand, linked
from benchmarks.plan_properties.wanted import Wanted
from hi5_common.domain.plan import Cell, Plan
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import Attribute

Columns = Mapping[Attribute, Sequence[str]]
"""The value (images,) that every image has of each attribute."""

BEGINNING = 2
"""Images: for every k, how far the images with a value among the first k may be from k times the
value's images over all images."""
PAIR, PAIR_BESIDE = 2, 2
"""Images: how far a pair of values may be from the product of their images over all images: where
no demand names their attributes, and where demands name one or both, but do not link them."""
AT_RANDOM = 5
"""Images that are asked for alone."""


@dataclass(frozen=True)
class Kept:
    """How far the worst is off, in images; faults are what is beyond a bound or not exact."""

    pair: float
    pair_beside: float
    beginning: float
    beginning_linked: float
    faults: tuple[str, ...]


def kept(spec: Drawn, plan: Plan) -> Kept:
    """Judge a plan by its images alone."""
    columns, wanted = columns_of(plan), spec.wanted()
    groups = [set(names) for names, _ in linked(spec.demands)]
    named = {name for group in groups for name in group}
    faults = [*_count_faults(spec, plan, columns, wanted), *_alone_faults(spec, plan)]
    pairs = {True: 0.0, False: 0.0}
    for a, b in itertools.combinations(wanted, 2):
        if not any({a, b} <= group for group in groups):
            free = not {a, b} & named
            off = _pair_off(columns[a], columns[b])
            pairs[free] = max(pairs[free], off)
            if off > (PAIR if free else PAIR_BESIDE) + 1e-9:
                faults.append(f"a pair of {a} and {b} is {off:.3f} images off")
    beginnings = {True: 0.0, False: 0.0}
    for name in wanted:
        off = _beginning_off(columns[name])
        beginnings[name in named] = max(beginnings[name in named], off)
        if off > BEGINNING + 1e-9:
            faults.append(f"a value of {name} is {off:.3f} images off among the first images")
    return Kept(pairs[True], pairs[False], beginnings[False], beginnings[True], tuple(faults))


def columns_of(plan: Plan) -> Columns:
    """Return every image's values, as the plan gives them out."""
    cells = list(plan.cells())
    return {name: [str(getattr(cell, name.value)) for cell in cells] for name in Attribute}


def digest(plan: Plan) -> str:
    """Return a hash of every image's values, in order."""
    hashed = hashlib.sha256()
    for column in columns_of(plan).values():
        hashed.update("\n".join(column).encode() + b"\0")
    return hashed.hexdigest()


def _count_faults(
    spec: Drawn, plan: Plan, columns: Columns, wanted: Mapping[Attribute, Wanted]
) -> Iterator[str]:
    for name, column in columns.items():
        if len(column) != spec.count:
            yield f"{len(column)} images instead of {spec.count}"
        came = Counter(column)
        allowed = wanted.get(name)
        if allowed is None:
            if len(came) != 1:
                yield f"{name} has a choice that was not asked for: {came}"
            continue
        if plan.value_counts(name) != {value: came[value] for value in allowed}:
            yield f"images of {name} are {came}, said are {plan.value_counts(name)}"
        if not set(came) <= set(allowed) or any(
            not low <= came[value] <= high for value, (low, high) in allowed.items()
        ):
            yield f"images of {name} are {came}, wanted {allowed}"
    for number, demand in enumerate(spec.demands):
        if (met := _met(columns, demand)) != demand.count:
            yield f"combination {number} has {met} images instead of {demand.count}"


def _met(columns: Columns, demand: Demand) -> int:
    has = [np.isin(columns[name], listed) for name, listed in demand.of.items()]
    return int(np.logical_and.reduce(has).sum())


def _alone_faults(spec: Drawn, plan: Plan) -> Iterator[str]:
    """Yield images that are others when they are asked for alone."""
    cells: list[Cell] = list(plan.cells())
    rng = factor_rng(spec.seed, 0, "benchmark/plan_properties/alone")
    for index in rng.integers(spec.count, size=AT_RANDOM).tolist():
        if plan.cell(index) != cells[index]:
            yield f"image {index} is another when it is asked for alone"


def _pair_off(a: Sequence[str], b: Sequence[str]) -> float:
    """Return how far the worst pair is from the product of its values' shares, in images."""
    values_a, numbers_a = np.unique(a, return_inverse=True)
    values_b, numbers_b = np.unique(b, return_inverse=True)
    met = np.zeros((len(values_a), len(values_b)), np.int64)
    np.add.at(met, (numbers_a, numbers_b), 1)
    product = np.outer(met.sum(axis=1), met.sum(axis=0))
    return float(np.abs(met * len(a) - product).max() / len(a))


def _beginning_off(column: Sequence[str]) -> float:
    """Return how far any value is from its share of any number of first images, in images."""
    values, numbers = np.unique(column, return_inverse=True)
    came = np.cumsum(numbers[:, None] == np.arange(len(values)), axis=0)
    shares = np.outer(np.arange(1, len(column) + 1), came[-1])
    return float(np.abs(came * len(column) - shares).max() / len(column))
