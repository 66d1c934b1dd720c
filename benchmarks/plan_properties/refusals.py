"""Whether a spec is refused exactly when it cannot be met, and in words that are true."""

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from benchmarks.plan_properties.drawing import Drawn
from benchmarks.plan_properties.linkage import linked
from benchmarks.plan_properties.oracle import Tables
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute

SMALLEST, FEW_DEMANDS = 3, 8
"""Up to so many demands the words name the smallest set that clashes, if it has no more than three;
else a set of which none can be left out: decision 0055."""
_CLASH = re.compile(
    r"(combinations\.\d+(?:, combinations\.\d+)*) cannot be met (?:together )?with the counts of "
    r"([a-z_, ]+)\. The nearest that can be met: (.+)\."
)
_CHANGE = re.compile(r"combinations\.(\d+)\.count: (\d+) instead of (\d+)")
_SUM = re.compile(
    r"The counts add up to (\d+) but count is (\d+): "
    r"ask for (\d+) (more|fewer) here, or set count to (\d+)\."
)


@dataclass(frozen=True)
class Clash:
    """What a refusal says of one group of attributes."""

    named: tuple[int, ...]
    attributes: tuple[str, ...]
    changes: tuple[tuple[int, int, int], ...]
    """A demand's number, its count that would work, and the one that was sent."""


@dataclass(frozen=True)
class Judged:
    """Whether a spec can be met, what is wrong with what hi5 says, and the sizes of clashes."""

    possible: bool
    faults: tuple[str, ...]
    clashes: tuple[int, ...] = ()


def judged(spec: Drawn) -> Judged:
    """Ask the oracle whether a spec can be met, and hold it against what `parse_spec` says."""
    problems = _problems(spec)
    if spec.wrong is not None:
        return Judged(False, tuple(_sum_faults(spec, spec.wrong, problems)))
    clashes = [clash for problem in problems if (clash := _read(problem)) is not None]
    faults = [f"in words of their own: {p}" for p in problems if _read(p) is None]
    possible, wanted = True, spec.wanted()
    for attributes, numbers in linked(spec.demands):
        said = [clash for clash in clashes if set(clash.named) <= set(numbers)]
        demands = [spec.demands[number] for number in numbers]
        tables = Tables(spec.count, attributes, wanted, demands)
        if tables.possible(range(len(numbers))):
            faults += [f"refused, though it can be met: {clash}" for clash in said]
            continue
        possible = False
        if len(said) == 1:
            faults += _clash_faults(spec, said[0], attributes, numbers, tables)
        else:
            faults.append(f"combinations {numbers} cannot be met: said of them is {said}")
    if not possible:
        faults += _offer_faults(spec, clashes)
    return Judged(possible, tuple(faults), tuple(len(clash.named) for clash in clashes))


def _problems(spec: Drawn) -> tuple[Problem, ...]:
    try:
        parse_spec(spec.document())
    except InvalidInput as refused:
        return refused.problems
    return ()


def _read(problem: Problem) -> Clash | None:
    """Return what the words of a refusal say, as a user reads them."""
    match = _CLASH.fullmatch(problem.remedy)
    if match is None:
        return None
    named = tuple(int(word.removeprefix("combinations.")) for word in match[1].split(", "))
    changes = []
    for part in match[3].split("; "):
        change = _CHANGE.fullmatch(part)
        if change is None:
            return None
        changes.append((int(change[1]), int(change[2]), int(change[3])))
    return Clash(named, tuple(match[2].split(", ")), tuple(changes))


def _clash_faults(
    spec: Drawn,
    clash: Clash,
    attributes: Sequence[Attribute],
    numbers: Sequence[int],
    tables: Tables,
) -> Iterator[str]:
    """Yield what is untrue of the demands named, and of the counts that are said to be nearest."""
    named = [numbers.index(number) for number in clash.named]
    if set(clash.attributes) != {name.value for name in attributes}:
        yield f"{clash.attributes} are named for {attributes}"
    if tables.possible(named):
        yield f"combinations {clash.named} are said to clash, and do not"
    for few in itertools.combinations(named, len(named) - 1):
        if not tables.possible(few):
            yield f"of combinations {clash.named} {few} (in the group) clash already"
    if len(numbers) <= FEW_DEMANDS:
        yield from (f"{few} clash, fewer than {named}" for few in _fewer(tables, numbers, named))
    if any(spec.demands[number].count != was for number, _, was in clash.changes):
        yield f"changes are not of the counts sent: {clash.changes}"
    offered = sum(abs(now - was) for _, now, was in clash.changes)
    if offered != (fewest := tables.fewest_changes()):
        yield f"the nearest changes {offered} images where {fewest} are enough: {clash.changes}"


def _fewer(
    tables: Tables, numbers: Sequence[int], named: Sequence[int]
) -> Iterator[tuple[int, ...]]:
    """Yield sets of demands that clash and are smaller than the one named, up to SMALLEST."""
    for size in range(1, min(len(named), SMALLEST + 1)):
        for few in itertools.combinations(range(len(numbers)), size):
            if not tables.possible(few):
                yield few


def _offer_faults(spec: Drawn, clashes: Sequence[Clash]) -> Iterator[str]:
    """Yield what is wrong with the spec after every change that was offered."""
    demands = list(spec.demands)
    for clash in clashes:
        for number, now, _ in clash.changes:
            demands[number] = replace(demands[number], count=now)
    changed = replace(spec, demands=tuple(demands))
    yield from (f"what is offered is refused: {problem}" for problem in _problems(changed))
    for attributes, numbers in linked(demands):
        group = [demands[number] for number in numbers]
        tables = Tables(spec.count, attributes, spec.wanted(), group)
        if not tables.possible(range(len(group))):
            yield f"what is offered for combinations {numbers} cannot be met"


def _sum_faults(spec: Drawn, wrong: Attribute, problems: Sequence[Problem]) -> Iterator[str]:
    """Yield what is untrue of the refusal of counts that do not add up."""
    counts = spec.requests[wrong]
    match = _SUM.fullmatch(problems[0].remedy) if len(problems) == 1 else None
    if not isinstance(counts, dict) or match is None:
        yield f"counts of {wrong} that do not add up: {problems}"
        return
    total = sum(counts.values())
    over = total - spec.count
    said = (int(match[1]), int(match[2]), int(match[3]), match[4], int(match[5]))
    if said != (total, spec.count, abs(over), "fewer" if over > 0 else "more", total):
        yield f"{problems[0]} is said of counts that add up to {total}"
    most = max(counts, key=lambda value: counts[value])
    mended = {**counts, most: counts[most] - over}
    asked = replace(spec, requests={**spec.requests, wrong: mended}, wrong=None)
    yield from (f"what is asked for is refused: {problem}" for problem in _problems(asked))
