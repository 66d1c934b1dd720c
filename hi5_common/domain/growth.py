"""Datasets that extend others: what stays as it was, and what may grow."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from hi5_common.domain.errors import Problem
from hi5_common.domain.planning.order import WOVEN
from hi5_common.domain.vocabulary import Attribute

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

MAX_GENERATIONS = 16
UNCHANGED = ("seed", "image", "render", "labels", "twins", "commercial_safe", "distributions")
"""Fields that an image depends on beside its cell: what is there must stay as it is."""


_CONDITIONS = {
    "combinations": "demanded combinations",
    "conditional": "conditional shares",
    "coverage": "coverage that was asked for",
}
_KEEP = "images that are there already depend on it. Keep it, or leave out extends."
_TWINS = "Twins differ in it, and the scenes that are there have fewer or others."


def problems(spec: "DatasetSpec") -> list[Problem]:
    """List why a spec cannot extend the one that it says it extends."""
    base = spec.extends
    if base is None:
        return []
    found = [
        Problem(field, _plain(spec, field), f"It was {_plain(base, field)}: {_KEEP}")
        for field in UNCHANGED
        if _plain(spec, field) != _plain(base, field)
    ]
    found += [
        Problem(f"attributes.{name.value}", list(spec.values_of(name)), f"{_TWINS} {_KEEP}")
        for name in spec.twinned()
        if spec.values_of(name) != base.values_of(name)
    ]
    if _split_by(spec) != _split_by(base):
        remedy = f"It was split by {_worded(_split_by(base))}: {_KEEP}"
        found.append(Problem("splits", _split_by(spec), remedy))
    for field, asked in _CONDITIONS.items():
        if getattr(spec, field) or getattr(base, field):
            remedy = f"A dataset with {asked} cannot be extended: submit one of its own."
            found.append(Problem(field, f"{len(getattr(spec, field))} of them", remedy))
    if spec.count <= base.count:
        remedy = f"There are {base.count} images already: ask for more."
        found.append(Problem("count", spec.count, remedy))
    if spec.count > WOVEN:
        remedy = f"What extends another dataset has {WOVEN:,} images at most."
        found.append(Problem("count", spec.count, remedy))
    if _generations(spec) > MAX_GENERATIONS:
        remedy = f"At most {MAX_GENERATIONS} datasets in a row: submit a dataset of its own."
        found.append(Problem("extends", f"{_generations(spec)} generations", remedy))
    if found:
        return found
    return [problem for name in Attribute for problem in _fewer(spec, base, name)]


def _plain(spec: "DatasetSpec", field: str) -> object:
    """Return a field as a user wrote it; of a list the order does not matter."""
    value = spec.model_dump(mode="json", include={field})[field]
    return sorted(value) if isinstance(value, list) else value


def _fewer(spec: "DatasetSpec", base: "DatasetSpec", name: Attribute) -> list[Problem]:
    """List values of which the larger dataset would have fewer images."""
    field = f"attributes.{name.value}"
    values, most = spec.values_of(name), _most(base, name)
    missing = [value for value, n in most.items() if n and value not in values]
    if missing:
        remedy = "The dataset that is extended has images of it: ask for it too."
        return [Problem(field, value, remedy) for value in missing]
    now = spec.counts_of(name)
    if now is not None:
        over = [value for value, n in most.items() if n > now.get(value, 0)]
    else:
        share, extra = divmod(spec.count, len(values))
        ahead = [value for value, n in most.items() if n > share]
        some = base.counts_of(name) is None and base.count // len(most) <= share
        certain = base.count % len(most) if ahead and some else len(ahead)
        further = [value for value in ahead if most[value] > share + 1]
        over = further or (ahead if certain > extra else [])
    remedy = "There are {} images of it already: ask for more images in all, or for counts."
    return [Problem(field, value, remedy.format(most[value])) for value in over]


def _most(spec: "DatasetSpec", name: Attribute) -> Mapping[str, int]:
    """Return the most images that each value may have."""
    counts = spec.counts_of(name)
    if counts is not None:
        return counts
    values = spec.values_of(name)
    return dict.fromkeys(values, -(-spec.count // len(values)))


def _split_by(spec: "DatasetSpec") -> tuple[str, tuple[str, ...]] | None:
    return None if spec.splits is None else (spec.splits.by.value, spec.splits.names)


def _generations(spec: "DatasetSpec") -> int:
    return 1 + (_generations(spec.extends) if spec.extends else 0)


def _worded(value: object) -> str:
    return "not there" if value is None else str(value)
