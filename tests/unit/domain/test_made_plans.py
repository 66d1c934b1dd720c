"""Random specs that are split, twinned and extended at once keep every promise, or are refused."""

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import VALUES, Attribute

SPECS = 150
CHOICES = ("gender", "skin_tone", "pose", "environment", "viewpoint", "ring")


def some(rng: np.random.Generator, values: tuple[str, ...], least: int = 1) -> list[str]:
    size = int(rng.integers(least, min(len(values), 12) + 1))
    return [values[k] for k in rng.permutation(len(values))[:size].tolist()]


def asked(rng: np.random.Generator, name: str, count: int, each: int) -> object:
    """Return a list, counts or weights of some values; counts are whole numbers of scenes."""
    values = some(rng, VALUES[Attribute(name)])
    match int(rng.integers(4)):
        case 0 if len(values) > 1:
            cuts = np.sort(rng.integers(0, count // each + 1, len(values) - 1))
            counts = np.diff([0, *cuts.tolist(), count // each]) * each
            return dict(zip(values, counts.tolist(), strict=True))
        case 1:
            return {"weights": {value: float(rng.uniform(0.2, 3.0)) for value in values}}
        case _:
            return values


def drawn(seed: int) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Return a random spec, and a larger one that extends it, as documents."""
    rng = np.random.default_rng(seed)
    twins = [name for name in ("gender", "skin_tone") if rng.random() < 0.25]
    attributes: dict[str, object] = {name: list(VALUES[Attribute(name)]) for name in twins}
    each = math.prod(len(VALUES[Attribute(name)]) for name in twins)
    count = each * int(rng.integers(20, 400 // each + 21))
    for name in CHOICES:
        if name not in attributes and rng.random() < 0.6:
            attributes[name] = asked(rng, name, count, each)
    document: dict[str, Any] = {"count": count, "seed": seed, "attributes": attributes}
    document["twins"] = twins
    if rng.random() < 0.5:
        weights = {"train": 6.0, "val": float(rng.uniform(1, 3)), "test": 1.5}
        by = str(rng.choice(["environment", "pose", "identity"]))
        document["splits"] = {"by": by, "images": {"weights": weights}}
    if rng.random() < 0.4:
        return document, None
    more = each * int(rng.integers(1, 500))
    equal = {name: v for name, v in attributes.items() if isinstance(v, list)}
    wider = {
        name: sorted({*values, *some(rng, VALUES[Attribute(name)])})
        if name not in twins
        else values
        for name, values in equal.items()
    }
    return document, {**document, "count": count + more, "attributes": wider, "extends": document}


def check(spec: DatasetSpec) -> Plan:
    plan = Plan.of(spec)
    cells = [cell.as_dict() for cell in plan.cells()]
    splits = [plan.split_of(index) for index in range(plan.count)]
    assert len(cells) == spec.count
    for name in plan.crossed:
        found = Counter(cell[name] for cell in cells)
        assert {v: found[v] for v in plan.value_counts(name)} == plan.value_counts(name)
        counts = plan.value_counts(name)
        if isinstance(spec.attributes[name], dict):
            assert counts == spec.attributes[name]
        elif spec.counts_of(name) is None:
            assert max(counts.values()) - min(counts.values()) <= spec.images_per_scene
    if spec.splits:
        assert Counter(splits) == plan.split_counts()
        attribute = spec.splits.attribute
        owners = (
            {(cell[attribute], split) for cell, split in zip(cells, splits, strict=True)}
            if (attribute)
            else set()
        )
        assert len(owners) == len({value for value, _ in owners})
    size = spec.images_per_scene
    for first in range(0, spec.count, size):
        scene = cells[first : first + size]
        assert len({tuple(cell[name] for name in spec.twins) for cell in scene}) == size
        assert (
            len({tuple(v for k, v in cell.items() if k not in spec.twins) for cell in scene}) == 1
        )
        assert len(set(splits[first : first + size])) == 1
    return plan


def judged(document: dict[str, Any]) -> Plan | None:
    """Check the plan of a document; None if it is refused."""
    try:
        return check(parse_spec(document))
    except InvalidInput:
        return None


@pytest.mark.parametrize("start", range(0, SPECS, 50))
def test_random_specs_keep_their_promises(start: int) -> None:
    planned, grown = 0, 0
    for seed in range(start, start + 50):
        first, second = drawn(seed)
        plan = judged(first)
        planned += plan is not None
        if plan is None or second is None:
            continue
        larger = judged(second)
        if larger is not None:
            grown += 1
            assert list(larger.cells(0, plan.count)) == list(plan.cells())
            assert [larger.split_of(i) for i in range(plan.count)] == [
                plan.split_of(i) for i in range(plan.count)
            ]
    assert planned > 25
    assert grown > 3
