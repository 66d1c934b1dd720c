"""Splits that do not leak: which values of what a dataset is split by belong to which split.

Every split is planned on its own, as a dataset of its own, and their images are interleaved.
"""

import re
from collections.abc import Mapping, Sequence
from enum import StrEnum
from functools import lru_cache
from typing import TYPE_CHECKING

import pydantic

from hi5_common.domain import spec_errors, twins
from hi5_common.domain.errors import Problem
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.shares import whole_shares
from hi5_common.domain.strict import StrictModel, Weights
from hi5_common.domain.vocabulary import Attribute, Pose

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

MAX_SPLITS = 10
_A_WEIGHT = (int | float, 1e-9, "number from 1e-9")
NAME = re.compile(r"[a-z0-9_-]{1,32}")


class SplitBy(StrEnum):
    """What no two splits have in common.

    environment: no place is in two. pose: no pose is, nor any that a hand is on its way to.
    identity: no hand is, which holds of any two images: each has a hand of its own.
    """

    ENVIRONMENT = "environment"
    POSE = "pose"
    IDENTITY = "identity"


class Splits(StrictModel):
    """How a dataset is split: by what, and how many images each split has: counts or weights."""

    by: SplitBy
    images: dict[str, int] | Weights

    @pydantic.field_validator("images", mode="before")
    @classmethod
    def _check(cls, asked: object) -> object:
        weights = asked.get("weights") if isinstance(asked, dict) else None
        shares = weights if isinstance(weights, dict) else asked
        if not isinstance(shares, dict):
            remedy = "Give counts, {train: 900, test: 100}, or {weights: {train: 9, test: 1}}."
            raise spec_errors.ProblemsFound([Problem("splits.images", asked, remedy)])
        kinds, least, what = (int, 1, "whole number from 1") if weights is None else _A_WEIGHT
        problems = [
            Problem(f"splits.images.{name}", n, f"Give a {what} to {spec_errors.MAX_WEIGHT:.0e}.")
            for name, n in shares.items()
            if isinstance(n, bool)
            or not isinstance(n, kinds)
            or not least <= n <= spec_errors.MAX_WEIGHT
        ]
        if not 2 <= len(shares) <= MAX_SPLITS:
            problems.append(
                Problem("splits.images", list(shares), f"Name 2 to {MAX_SPLITS} splits.")
            )
        problems += [
            Problem("splits.images", name, "A name is 1 to 32 of a-z, 0-9, _ and -.")
            for name in shares
            if not _is_name(name)
        ]
        if problems:
            raise spec_errors.ProblemsFound(problems)
        return asked

    @property
    def names(self) -> tuple[str, ...]:
        """Return the splits' names by alphabet: JSON keeps no other order."""
        asked = self.images.weights if isinstance(self.images, Weights) else self.images
        return tuple(sorted(asked))

    @property
    def counts(self) -> dict[str, int] | None:
        """Return the images asked for; None where weights are."""
        if isinstance(self.images, Weights):
            return None
        return {name: self.images[name] for name in self.names}

    @property
    def attribute(self) -> Attribute | None:
        """Return the attribute of which each value is in one split; None of identities."""
        return None if self.by is SplitBy.IDENTITY else Attribute(self.by.value)

    @property
    def shares(self) -> dict[str, float]:
        """Return the splits' shares, which add up to 1."""
        asked = self.images.weights if isinstance(self.images, Weights) else self.images
        whole = sum(asked.values())
        return {name: asked[name] / whole for name in self.names}


class NoSplit(ValueError):
    """The splits that a spec asks for cannot be."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        super().__init__(str(problem))


def problems(spec: "DatasetSpec") -> list[Problem]:
    """List what is wrong with the splits of a spec whose attributes are right."""
    splits = spec.splits
    if splits is None:
        return []
    for asked in ("combinations", "conditional", "coverage"):
        if getattr(spec, asked):
            remedy = f"A dataset that is split cannot have {asked}: submit each split by itself."
            return [Problem("splits", splits.by.value, remedy)]
    if splits.counts and sum(splits.counts.values()) != spec.count:
        total = sum(splits.counts.values())
        remedy = f"They add up to {total}, but count is {spec.count}: change either."
        return [Problem("splits.images", splits.counts, remedy)]
    attribute = splits.attribute
    if attribute and splits.counts and spec.counts_of(attribute):
        remedy = f"{attribute.value} has counts of its own: give the splits weights."
        return [Problem("splits.images", splits.counts, remedy)]
    try:
        parts(twins.scenes_of(spec))
    except NoSplit as error:
        return [error.problem]
    return []


def dealt(spec: "DatasetSpec") -> dict[str, tuple[str, ...]]:
    """Return the values that each split has of what it is split by. Raises NoSplit.

    The seed shuffles the values; each goes to the split that lacks most of its share. What a
    dataset that is extended had stays where it was.
    """
    splits = _splits(spec)
    attribute = splits.attribute
    if attribute is None:
        return {}
    weights = spec.counts_of(attribute) or dict.fromkeys(spec.values_of(attribute), 1)
    own: dict[str, list[str]] = {name: [] for name in splits.names}
    if spec.extends and spec.extends.splits:
        for name, had in dealt(spec.extends).items():
            own[name] = [value for value in had if value in weights]
    known = {value for values in own.values() for value in values}
    new = [value for value in weights if value not in known]
    rng = factor_rng(spec.seed, 0, f"splits/{attribute.value}")
    shuffled = [new[k] for k in rng.permutation(len(new)).tolist()]
    shuffled.sort(key=lambda value: -weights[value])
    whole = sum(weights.values())
    for place, value in enumerate(shuffled):
        empty = [name for name in splits.names if not own[name]]
        among = empty if len(empty) >= len(shuffled) - place else splits.names
        lack = {
            name: splits.shares[name] * whole - sum(weights.get(v, 0) for v in own[name])
            for name in among
        }
        own[max(among, key=lambda name: lack[name])].append(value)
    for name, values in own.items():
        if not any(weights[value] for value in values):
            remedy = f"There are too few values of {attribute.value} for so many splits."
            raise NoSplit(Problem("splits.images", name, remedy))
    order = spec.values_of(attribute)
    return {name: tuple(sorted(values, key=order.index)) for name, values in own.items()}


def poses_beside(spec: "DatasetSpec", pose: Pose, index: int) -> tuple[Pose, ...]:
    """Return the poses that the hand of image `index` may be on its way to, its own among them.

    All there are, unless the dataset is split by poses: then those of the same split, of the
    dataset that the image was in first.
    """
    if spec.splits is None or spec.splits.by is not SplitBy.POSE:
        return tuple(Pose)
    while spec.extends is not None and index < spec.extends.count:
        spec = spec.extends
    return next(poses for poses in _poses_dealt(spec.canonical_json()) if pose in poses)


@lru_cache(maxsize=16)
def _poses_dealt(canonical_json: str) -> tuple[tuple[Pose, ...], ...]:
    from hi5_common.domain.spec import DatasetSpec  # which knows what splits are

    own = dealt(twins.scenes_of(DatasetSpec.model_validate_json(canonical_json)))
    return tuple(tuple(map(Pose, values)) for values in own.values())


def parts(spec: "DatasetSpec") -> dict[str, "DatasetSpec"]:
    """Return each split as a dataset of its own. Raises NoSplit."""
    splits = _splits(spec)
    own, attribute = dealt(spec), splits.attribute
    earlier = parts(spec.extends) if spec.extends else {}
    if attribute and splits.counts is None:
        of_values = wanted(spec, attribute)
        shared = {attribute: {n: {v: of_values[v] for v in own[n]} for n in splits.names}}
        sizes = {name: sum(shared[attribute][name].values()) for name in splits.names}
    else:
        sizes = splits.counts or whole_shares(splits.shares, spec.count)
        shared = {attribute: {n: _evenly(own[n], sizes[n]) for n in own}} if attribute else {}
    for name, size in sizes.items():
        if not size:
            remedy = "Its share is less than an image: ask for more."
            raise NoSplit(Problem("splits.images", name, remedy))
        if name in earlier and size < earlier[name].count:
            remedy = f"It has {earlier[name].count} images already: ask for as many, or for more."
            raise NoSplit(Problem(f"splits.images.{name}", size, remedy))
    for other in Attribute:
        if other is not attribute and len(spec.values_of(other)) > 1:
            share = _dealt_evenly if spec.counts_of(other) is None else _shared
            shared[other] = share(spec, other, sizes, _least(other, earlier))
    return {
        name: _part(spec, number, sizes[name], shared, earlier)
        for number, name in enumerate(splits.names)
    }


def image_counts(spec: "DatasetSpec") -> dict[str, int]:
    """Return the number of images of each split; nothing if the dataset is not split."""
    if spec.splits is None:
        return {}
    scenes = twins.scenes_of(spec)
    return {name: spec.images_per_scene * part.count for name, part in parts(scenes).items()}


def wanted(spec: "DatasetSpec", attribute: Attribute) -> dict[str, int]:
    """Return the images of each value; where shares are equal the seed says who has one more."""
    counts = spec.counts_of(attribute)
    if counts is not None:
        return counts
    values = spec.values_of(attribute)
    rng = factor_rng(spec.seed, 0, f"splits/{attribute.value}/more")
    shuffled = [values[k] for k in rng.permutation(len(values)).tolist()]
    counts = _evenly(shuffled, spec.count)
    return {value: counts[value] for value in values}


def _evenly(values: Sequence[str], count: int) -> dict[str, int]:
    share, extra = divmod(count, len(values))
    return {value: share + (place < extra) for place, value in enumerate(values)}


def _least(
    attribute: Attribute, earlier: Mapping[str, "DatasetSpec"]
) -> dict[str, Mapping[str, int]]:
    """Return the images that there are of each value in each split of what is extended."""
    return {name: wanted(part, attribute) for name, part in earlier.items()}


def _dealt_evenly(
    spec: "DatasetSpec",
    attribute: Attribute,
    sizes: Mapping[str, int],
    least: Mapping[str, Mapping[str, int]],
) -> dict[str, dict[str, int]]:
    """Return the images of each value in each split: equal shares in every split, and in all.

    One image more goes to the values that have it already, then to those with the fewest so far.
    """
    values = list(wanted(spec, attribute))
    total, table = dict.fromkeys(values, 0), dict[str, dict[str, int]]()
    later = _more_later(values, sizes, least)
    for name, size in sizes.items():
        share, extra = divmod(size, len(values))
        had = least.get(name, {})
        order = sorted(values, key=lambda v: (had.get(v, 0) <= share, total[v] + later[name][v]))
        table[name] = dict.fromkeys(values, share)
        for value in order[:extra]:
            table[name][value] += 1
        for value in values:
            total[value] += table[name][value]
            if table[name][value] < had.get(value, 0):
                raise _too_few(spec, attribute)
    if max(total.values()) - min(total.values()) > 1:
        raise _too_few(spec, attribute)
    return table


def _more_later(
    values: Sequence[str], sizes: Mapping[str, int], least: Mapping[str, Mapping[str, int]]
) -> dict[str, dict[str, int]]:
    """Return for each split which values have one image more already in splits after it."""
    more, found = dict.fromkeys(values, 0), dict[str, dict[str, int]]()
    for name in reversed(list(sizes)):
        found[name] = dict(more)
        share = sizes[name] // len(values)
        for value in values:
            more[value] += least.get(name, {}).get(value, 0) > share
    return found


def _shared(
    spec: "DatasetSpec",
    attribute: Attribute,
    sizes: Mapping[str, int],
    least: Mapping[str, Mapping[str, int]],
) -> dict[str, dict[str, int]]:
    """Return the images of each value in each split: the whole numbers below or above its share.

    Rows and columns add up: what is left of a value goes to splits that have images left, the
    values of which most is left first.
    """
    counts = wanted(spec, attribute)
    table = {
        name: {
            value: max(n * size // spec.count, least.get(name, {}).get(value, 0))
            for value, n in counts.items()
        }
        for name, size in sizes.items()
    }
    left = {v: n - sum(table[name][v] for name in sizes) for v, n in counts.items()}
    for name, size in sizes.items():
        while (more := size - sum(table[name].values())) > 0:
            for value in sorted(left, key=lambda value: -left[value])[:more]:
                table[name][value] += 1
                left[value] -= 1
    if any(left.values()) or any(sum(table[name].values()) != n for name, n in sizes.items()):
        raise _too_few(spec, attribute)
    return table


def _too_few(spec: "DatasetSpec", attribute: Attribute) -> NoSplit:
    remedy = (
        f"The splits cannot grow by so few images with {attribute.value} as asked for: "
        "ask for more, or for a dataset of its own without extends."
    )
    return NoSplit(Problem("count", spec.count, remedy))


def _part(
    spec: "DatasetSpec",
    number: int,
    size: int,
    shared: Mapping[Attribute, Mapping[str, Mapping[str, int]]],
    earlier: Mapping[str, "DatasetSpec"],
) -> "DatasetSpec":
    name = _splits(spec).names[number]
    before = earlier.get(name)
    if before is not None and size == before.count:
        return before
    asked = {
        attribute.value: list(counts[name])
        if len(set(counts[name].values())) == 1
        else dict(counts[name])
        for attribute, counts in shared.items()
    }
    return spec.model_copy(
        update={
            "count": size,
            "seed": int(factor_rng(spec.seed, number, "splits").integers(2**63)),
            "attributes": spec.attributes.model_copy(update=asked),
            "splits": None,
            "images_per_shard": None,
            "extends": before,
        }
    )


def _splits(spec: "DatasetSpec") -> Splits:
    if spec.splits is None:
        raise ValueError("the spec asks for no splits")
    return spec.splits


def _is_name(name: object) -> bool:
    return isinstance(name, str) and NAME.fullmatch(name) is not None
