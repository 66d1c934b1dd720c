"""The figures of a run: how fast a fleet recovers, and what it renders in vain."""

from bisect import bisect_right
from collections import Counter
from dataclasses import dataclass
from typing import Any

from benchmarks.nemesis.history import Entry
from benchmarks.nemesis.run import Outcome
from hi5_common.db.events import Event
from hi5_common.domain.lifecycle import Transition


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

    next_finish: from the end of a fault to the next publication, of any shard. hit_finish: from the
    end of a fault until every shard that was leased when it struck is published.
    """

    faults: Counter[str]
    missed: int
    shards: int
    images: int
    attempts: int
    retried_by_users: int
    next_finish: Spread
    hit_finish: Spread
    hit_finish_by_kind: dict[str, Spread]
    ends: Counter[str]
    """How attempts ended: the names of transitions."""

    @property
    def overhead(self) -> float:
        """Attempts in vain, as a share of the shards."""
        return self.attempts / max(1, self.shards) - 1


def report(outcome: Outcome) -> Report:
    """Work the figures out."""
    struck = [entry for entry in outcome.entries if entry.what == "fault"]
    healed = {
        entry.fields["number"]: entry.at_s for entry in outcome.entries if entry.what == "healed"
    }
    events = [event for event in outcome.world.events if event.shard_number is not None]
    finishes = sorted(event.at.timestamp() for event in events if event.kind == Transition.FINISH)
    waits = [_until_next(finishes, healed[each.fields["number"]]) for each in struck]
    hits: dict[str, list[float]] = {}
    spans = _spans(events)
    for each in struck:
        until_s = _until_hit_finished(spans, each.at_s, healed[each.fields["number"]])
        if until_s is not None:
            hits.setdefault(each.fields["name"], []).append(until_s)
    kinds = Counter(event.kind for event in events)
    return Report(
        faults=Counter(each.fields["name"] for each in struck),
        missed=_count(outcome.entries, "missed"),
        shards=len(outcome.world.shards),
        images=sum(dataset.count for dataset in outcome.world.datasets),
        attempts=kinds[Transition.CLAIM],
        retried_by_users=_count(outcome.entries, "user_retry"),
        next_finish=_spread([wait for wait in waits if wait is not None]),
        hit_finish=_spread([wait for found in hits.values() for wait in found]),
        hit_finish_by_kind={name: _spread(hits[name]) for name in sorted(hits)},
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
        "overhead": round(figures.overhead, 4),
        "ends": dict(figures.ends),
        "seconds_to_next_publication": vars(figures.next_finish),
        "seconds_until_hit_shards_are_published": vars(figures.hit_finish),
        "the_same_by_kind": {
            name: vars(spread) for name, spread in figures.hit_finish_by_kind.items()
        },
        "violations": outcome.verdict.counts(),
        "violations_in_words": outcome.verdict.lines(),
    }


def in_words(outcome: Outcome, figures: Report) -> str:
    """Return the figures for people."""
    total = figures.faults.total()
    rows = [
        f"  {name.lower():16} {count:5}  {_words(figures.hit_finish_by_kind.get(name))}"
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
    next_finish, hit_finish = _words(figures.next_finish), _words(figures.hit_finish)
    return "\n".join(
        [
            head,
            f"violations: {wrong}",
            *(f"  {line}" for line in outcome.verdict.lines()[:40]),
            f"attempts: {figures.attempts}, {figures.overhead:.1%} in vain; {ends}",
            f"asked again by users: {figures.retried_by_users}",
            f"from a fault's end to the next publication: {next_finish}",
            f"from a fault's end until the shards it met are published: {hit_finish}",
            *rows,
            f"0 in {total} faults means at most {3 / max(1, total):.3%} of faults, at 95 %",
        ]
    )


def _until_next(finishes: list[float], at_s: float) -> float | None:
    place = bisect_right(finishes, at_s)
    return finishes[place] - at_s if place < len(finishes) else None


@dataclass(frozen=True)
class _Span:
    """A time in which a shard was leased, and when it was published at last."""

    since_s: float
    until_s: float
    finished_s: float


def _spans(events: list[Event]) -> list[_Span]:
    by_shard: dict[tuple[object, object], list[Event]] = {}
    for event in events:
        by_shard.setdefault((event.dataset_id, event.shard_number), []).append(event)
    found = []
    for told in by_shard.values():
        finished = [event.at.timestamp() for event in told if event.kind == Transition.FINISH]
        for claim, after in zip(told, [*told[1:], None], strict=True):
            if claim.kind == Transition.CLAIM and after is not None and finished:
                found.append(_Span(claim.at.timestamp(), after.at.timestamp(), finished[-1]))
    return found


def _until_hit_finished(spans: list[_Span], struck_s: float, healed_s: float) -> float | None:
    """Return None if nothing was leased when the fault struck."""
    hit = [span.finished_s for span in spans if span.since_s <= struck_s <= span.until_s]
    return max(0.0, max(hit) - healed_s) if hit else None


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
        return ""
    return f"p50 {spread.p50:.1f} s, p99 {spread.p99:.1f} s, longest {spread.longest:.1f} s"


def _count(entries: list[Entry], what: str) -> int:
    return sum(entry.what == what for entry in entries)
