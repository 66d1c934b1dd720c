"""How long recovery took, from a history and events made by hand."""

from datetime import UTC, datetime
from uuid import UUID

from benchmarks.nemesis.checker import Verdict
from benchmarks.nemesis.history import Entry
from benchmarks.nemesis.report import report
from benchmarks.nemesis.run import Options, Outcome
from benchmarks.nemesis.world import World
from hi5_common.db.events import Event

DATASET = UUID(int=1)


def event(at_s: float, number: int, kind: str) -> Event:
    return Event(datetime.fromtimestamp(at_s, UTC), DATASET, number, 1, kind, "w", None)


def test_recovery() -> None:
    events = (
        event(10, 0, "claim"),
        event(12, 1, "claim"),
        event(14, 1, "finish"),
        event(20, 0, "expire"),
        event(21, 0, "claim"),
        event(24, 0, "finish"),
    )
    entries = [
        Entry(13, "fault", {"number": 0, "kind": "k", "name": "A", "target": "w"}),
        Entry(13.5, "healed", {"number": 0}),
        Entry(15, "fault", {"number": 1, "kind": "k", "name": "B", "target": "w"}),
        Entry(16, "healed", {"number": 1}),
        Entry(17, "missed", {"number": 2}),
    ]
    world = World((), (), events, {})
    figures = report(Outcome(Options(1, 2, 2), entries, world, Verdict(), 30, 5))
    assert figures.faults == {"A": 1, "B": 1}
    assert figures.missed == 1
    assert (figures.attempts, figures.in_vain, figures.overhead) == (3, 1, 0.5)
    # The next publication: 14 after 13.5, and 24 after 16.
    assert (figures.next_finish.p50, figures.next_finish.longest) == (0.5, 8.0)
    # The first attempt at shard 0 ended at 20, the last fault before that at 16; claimed at 21.
    assert figures.given_back_by_kind.keys() == {"B"}
    assert figures.given_back_by_kind["B"].longest == 4.0
    assert figures.taken_up.longest == 5.0
