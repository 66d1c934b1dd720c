"""What is wrong with the conditions of a spec: misnamed ones, and those that clash."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from hi5_common.domain import coverage, twins
from hi5_common.domain.demands import MOST_CELLS, Group, Named, Values, follows, groups
from hi5_common.domain.errors import Problem
from hi5_common.domain.planning.linked import Linked
from hi5_common.domain.planning.terms import AtLeast, Conditional
from hi5_common.domain.vocabulary import Attribute

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

MOST_OVERLAPPING = 48
"""Combinations of classes of values where conditional shares of one attribute overlap, at most."""

Nearest = tuple[int | tuple[int, ...] | None, ...]


def problems(spec: "DatasetSpec") -> list[Problem]:
    """List what is wrong with the conditions of a spec whose attributes are right."""
    if not (spec.combinations or spec.conditional or spec.coverage):
        return []
    if spec.twins:
        return _of_scenes(spec)
    found = [
        problem
        for number, combination in enumerate(spec.combinations)
        for problem in _misnamed_combination(spec, number, combination.of)
    ]
    for number in range(len(spec.conditional)):
        found += _misnamed_conditional(spec, number)
    found += coverage.problems(spec)
    if found:
        return found
    values = {attribute: spec.values_of(attribute) for attribute in Attribute}
    for group in _judged(spec, values):
        wrong = _too_many(spec, group) or _too_intricate(group) or _clashes(spec, group)
        found += [problem for problem in wrong if problem not in found]
    return found


def _judged(spec: "DatasetSpec", values: Values) -> list[Group]:
    """Return groups of which each must be possible.

    Coverage that would link too much at once is judged one by one: it hardly ever needs linking,
    and a plan that needs more than can be linked is refused (see ordering.py).
    """
    bound = coverage.bound(spec)
    together = groups(spec, values, bound)
    if len(bound) < 2 or all(_cells(group) <= MOST_CELLS for group in together):
        return together
    return [group for number in bound for group in groups(spec, values, (number,))]


def linkable(group: Group) -> bool:
    """Tell whether a group can be planned: it is not too large, and its conditions can be met."""
    return _cells(group) <= MOST_CELLS and not _clash(group.linked)[0]


def _of_scenes(spec: "DatasetSpec") -> list[Problem]:
    """Twins are planned as scenes: it is those that conditions are met with."""
    note = f" (Here {spec.images_per_scene} images, the twins of a scene, are counted as one.)"
    found = problems(twins.scenes_of(spec))
    return [replace(problem, remedy=f"{problem.remedy}{note}") for problem in found]


def _misnamed_combination(
    spec: "DatasetSpec", number: int, asked: Mapping[Attribute, Sequence[str]]
) -> list[Problem]:
    field = f"combinations.{number}.of"
    if len(asked) < 2:
        remedy = "Name two attributes or more; one alone has its counts under attributes."
        return [Problem(field, ", ".join(asked), remedy)]
    return _misnamed(spec, field, asked)


def _misnamed_conditional(spec: "DatasetSpec", number: int) -> list[Problem]:
    asked, field = spec.conditional[number], f"conditional.{number}"
    if not asked.given or asked.of in asked.given:
        remedy = f"Name at least one attribute, and another than {asked.of.value}."
        return [Problem(f"{field}.given", ", ".join(asked.given), remedy)]
    found = _misnamed(spec, f"{field}.given", asked.given)
    values = spec.values_of(asked.of)
    if asked.of not in spec.balanced():
        remedy = f"Every image has {values[0]}: ask for more values under attributes first."
        return [*found, Problem(f"{field}.of", asked.of.value, remedy)]
    remedy = f"The dataset has no such value: it has {', '.join(values[:50])}."
    return found + [
        Problem(f"{field}.shares", value, remedy) for value in asked.shares if value not in values
    ]


def _misnamed(
    spec: "DatasetSpec", field: str, asked: Mapping[Attribute, Sequence[str]]
) -> list[Problem]:
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


def _cells(group: Group) -> int:
    return math.prod(strand.size for strand in group.linked.strands)


def _too_many(spec: "DatasetSpec", group: Group) -> list[Problem]:
    if _cells(group) <= MOST_CELLS:
        return []
    names = ", ".join(attribute.value for attribute in group.attributes)
    many = f"{_cells(group):,} combinations, over {MOST_CELLS:,}."
    remedy = f"They link {names}, which have {many} Ask for fewer values"
    enough = [
        images
        for condition in group.conditions
        if condition.field == "coverage"
        and (images := coverage.enough(spec, condition.number)) is not None
    ]
    more = f", or for {max(enough):,} images or more, which need no linking" if enough else ""
    return [Problem(group.conditions[-1].field, names, f"{remedy}{more}.")]


def _too_intricate(group: Group) -> list[Problem]:
    """Refuse shares of one attribute among sets that overlap, where a solver might not end."""
    shared = [one for one in group.conditions if isinstance(one.term, Conditional)]
    for a, b in itertools.combinations(shared, 2):
        first, second = a.term, b.term
        if not (isinstance(first, Conditional) and isinstance(second, Conditional)):
            continue
        if first.overlaps(second) and group.linked.classes > MOST_OVERLAPPING:
            remedy = (
                f"Some images are given by {a} and {b} both: give sets of images that have none in "
                "common, or shares of fewer values."
            )
            return [Problem(f"{b}.given", "an overlap", remedy)]
    return []


@lru_cache(maxsize=64)
def _clash(linked: Linked) -> tuple[tuple[int, ...], Nearest]:
    """Return the conditions that clash, and the nearest: kept, for specs are read often."""
    if len(linked.demands) == 1 and isinstance(linked.demands[0], AtLeast) and not linked.free:
        return (), ()  # Enough images of every value are enough: see coverage.problems.
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
    named = [group.conditions[k] for k in clash]
    changes = [
        change
        for condition, found in zip(group.conditions, nearest, strict=True)
        if (change := _change(spec, condition, found)) is not None
    ]
    words = ", ".join(map(str, named))
    together = "cannot be met with" if len(named) == 1 else "cannot be met together with"
    asked = [name for name in group.attributes if not follows(spec, name)]
    remedy = (
        f"{words} {together} the counts of {', '.join(a.value for a in asked)}. "
        f"The nearest that can be met: {'; '.join(changes)}."
    )
    field, shown = f"{named[0]}.{_PARTS[named[0].field]}", [_asked(spec, one) for one in named]
    return [Problem(field, " and ".join(shown), remedy)]


_PARTS = {"combinations": "count", "conditional": "shares", "coverage": "at_least"}
"""What can be changed of a condition."""


def _asked(spec: "DatasetSpec", condition: Named) -> str:
    asked = getattr(spec, condition.field)[condition.number]
    found = getattr(asked, _PARTS[condition.field])
    return _worded(found) if isinstance(found, dict) else str(found)


def _change(
    spec: "DatasetSpec", condition: Named, found: int | tuple[int, ...] | None
) -> str | None:
    """Say what a condition could ask for instead; None where what it asks for can be met."""
    before = _asked(spec, condition)
    if isinstance(found, tuple):
        values = spec.values_of(spec.conditional[condition.number].of)
        now = _worded({v: n for v, n in zip(values, found, strict=True) if n})
    else:
        now = before if found is None else str(found)
    if now == before:
        return None
    return f"{condition}.{_PARTS[condition.field]}: {now} instead of {before}"


def _worded(shares: Mapping[str, float]) -> str:
    return f"{{{', '.join(f'{value}: {n:g}' for value, n in shares.items())}}}"
