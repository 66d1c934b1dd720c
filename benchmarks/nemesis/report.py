"""The figures of a run: how fast a fleet recovers, and what it renders in vain."""

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from benchmarks.nemesis.history import Entry
from benchmarks.nemesis.run import Outcome
from hi5_common.db.events import Event
from hi5_common.domain.lifecycle import Transition

_BROKEN_BY = frozenset(
    {Transition.EXPIRE, Transition.RETRY, Transition.RELEASE, Transition.FAIL, Transition.CANCEL}
)


@dataclass(frozen=True)
class Spread:
    """How long something took, in seconds."""

    count: int
    p50: float
    p99: float
    longest: float


@dataclass(frozen=True)
class Report:
    """The figures.

    next_finish: from the end of a fault to the next publication, of any shard. given_back and
    taken_up: for each attempt that came to nothing, from the end of the last fault before its end
    until its shard is back in the queue, and until it is claimed again. Older shards go first, so
    the second counts the queue before it, too.
    """

    faults: Counter[str]
    missed: int
    shards: int
    images: int
    attempts: int
    retried_by_users: int
    next_finish: Spread
    given_back: Spread
    given_back_by_kind: dict[str, Spread]
    taken_up: Spread
    ends: Counter[str]
    """How attempts ended: the names of transitions."""

    @property
    def in_vain(self) -> int:
        """Attempts that published nothing."""
        return self.attempts - self.ends[Transition.FINISH]

    @property
    def overhead(self) -> float:
        """The same, as a share of the publications."""
        return self.in_vain / max(1, self.ends[Transition.FINISH])


def report(outcome: Outcome) -> Report:
    """Work the figures out."""
    struck = [entry for entry in outcome.entries if entry.what == "fault"]
    healed = {
        entry.fields["number"]: entry.at_s for entry in outcome.entries if entry.what == "healed"
    }
    events = [event for event in outcome.world.events if event.shard_number is not None]
    finishes = sorted(event.at.timestamp() for event in events if event.kind == Transition.FINISH)
    waits = [_until_next(finishes, healed[each.fields["number"]]) for each in struck]
    back: dict[str, list[float]] = {}
    again: list[float] = []
    for broken in _broken_attempts(events):
        cause = _last_before(struck, broken)
        if cause is not None:
            since_s = healed[cause.fields["number"]]
            back.setdefault(cause.fields["name"], []).append(max(0.0, broken.ended_s - since_s))
            again.append(max(0.0, broken.claimed_again_s - since_s))
    kinds = Counter(event.kind for event in events)
    return Report(
        faults=Counter(each.fields["name"] for each in struck),
        missed=_count(outcome.entries, "missed"),
        shards=len(outcome.world.shards),
        images=sum(dataset.count for dataset in outcome.world.datasets),
        attempts=kinds[Transition.CLAIM],
        retried_by_users=_count(outcome.entries, "retry_done"),
        next_finish=_spread([wait for wait in waits if wait is not None]),
        given_back=_spread([wait for found in back.values() for wait in found]),
        given_back_by_kind={name: _spread(back[name]) for name in sorted(back)},
        taken_up=_spread(again),
        ends=kinds,
    )


def as_json(outcome: Outcome, figures: Report) -> dict[str, Any]:
    """Return everything that is worth keeping of a run."""
    return {
        "seed": outcome.options.seed,
        "seconds": round(outcome.seconds, 1),
        "seconds_after_the_last_fault": round(outcome.quiet_seconds, 1),
        "faults": dict(figures.faults),
        "missed": figures.missed,
        "shards": figures.shards,
        "images": figures.images,
        "attempts": figures.attempts,
        "retried_by_users": figures.retried_by_users,
        "in_vain": figures.in_vain,
        "overhead": round(figures.overhead, 4),
        "ends": dict(figures.ends),
        "seconds_to_next_publication": vars(figures.next_finish),
        "seconds_until_broken_off_shards_are_back_in_the_queue": vars(figures.given_back),
        "the_same_by_kind": {
            name: vars(spread) for name, spread in figures.given_back_by_kind.items()
        },
        "seconds_until_they_are_claimed_again": vars(figures.taken_up),
        "violations": outcome.verdict.counts(),
        "violations_in_words": outcome.verdict.lines(),
    }


def in_words(outcome: Outcome, figures: Report) -> str:
    """Return the figures for people."""
    total = figures.faults.total()
    rows = [
        f"  {name.lower():16} {count:5}  {_words(figures.given_back_by_kind.get(name))}"
        for name, count in sorted(figures.faults.items())
    ]
    head = (
        f"seed {outcome.options.seed}: {total} faults of {len(figures.faults)} kinds on "
        f"{figures.shards} shards ({figures.images} images) in {outcome.seconds:.0f} s, "
        f"{outcome.quiet_seconds:.0f} s of them after the last fault; "
        f"{figures.missed} strikes found nothing to hit"
    )
    wrong = ", ".join(f"{name} {count}" for name, count in outcome.verdict.counts().items())
    ends = ", ".join(f"{name} {count}" for name, count in sorted(figures.ends.items()))
    return "\n".join(
        [
            head,
            f"violations: {wrong}",
            *(f"  {line}" for line in outcome.verdict.lines()[:40]),
            f"attempts: {figures.attempts}, in vain {figures.in_vain} ({figures.overhead:.1%})",
            f"what became of shards: {ends}",
            f"asked again by users: {figures.retried_by_users}",
            f"from a fault's end to the next publication: {_words(figures.next_finish)}",
            "from a fault's end until a shard it broke off is claimed again, older ones first: "
            + _words(figures.taken_up),
            f"and until it is back in the queue: {_words(figures.given_back)}; by kind of fault:",
            *rows,
            f"0 in {total} faults means at most {3 / max(1, total):.3%} of faults, at 95 %",
        ]
    )


def _until_next(finishes: list[float], at_s: float) -> float | None:
    place = bisect_right(finishes, at_s)
    return finishes[place] - at_s if place < len(finishes) else None


@dataclass(frozen=True)
class _Broken:
    """An attempt that came to nothing, and when its shard was claimed again."""

    claimed_s: float
    ended_s: float
    claimed_again_s: float


def _broken_attempts(events: list[Event]) -> Iterator[_Broken]:
    by_shard: dict[tuple[object, object], list[Event]] = {}
    for event in events:
        by_shard.setdefault((event.dataset_id, event.shard_number), []).append(event)
    for told in by_shard.values():
        claims = [event.at.timestamp() for event in told if event.kind == Transition.CLAIM]
        ends = [event.at.timestamp() for event in told if event.kind in _BROKEN_BY]
        for claimed_s, again_s in pairwise(claims):
            yield _Broken(claimed_s, min(at_s for at_s in ends if at_s > claimed_s), again_s)


def _last_before(struck: list[Entry], broken: _Broken) -> Entry | None:
    """Return the last fault while an attempt went on, the likely cause of its end."""
    place = bisect_right(struck, broken.ended_s, key=lambda entry: entry.at_s)
    cause = struck[place - 1] if place else None
    return cause if cause is not None and cause.at_s >= broken.claimed_s else None


def _spread(seconds: list[float]) -> Spread:
    if not seconds:
        return Spread(0, 0.0, 0.0, 0.0)
    ordered = sorted(seconds)
    return Spread(
        len(ordered),
        round(ordered[(len(ordered) - 1) // 2], 2),
        round(ordered[min(len(ordered) - 1, int(len(ordered) * 0.99))], 2),
        round(ordered[-1], 2),
    )


def _words(spread: Spread | None) -> str:
    if spread is None:
        return "broke no attempt off"
    times = f"p50 {spread.p50:.1f} s, p99 {spread.p99:.1f} s, longest {spread.longest:.1f} s"
    return f"{times} ({spread.count} times)"


def _count(entries: list[Entry], what: str) -> int:
    return sum(entry.what == what for entry in entries)
