"""What benchmarks/endpoints puts into a database is what workers put there."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import pytest

from benchmarks.endpoints.filling import GAP_EVERY, REDRAW_EVERY, Counting, deliver, publication_of
from hi5_common.db import datasets, deliveries
from hi5_common.db.engine import Database
from hi5_common.db.tables import ShardRow
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Shard, ShardStatus
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.tallies import tally
from hi5_common.storage.open import memory_store
from services.worker.fleet.shard_runner import Outcome
from tests.support.runners import runner

SMALL = {
    "count": 10,
    "images_per_shard": 4,
    "image": {"width": 64, "height": 64},
    "attributes": {"gender": ["female"]},  # half the hands to compile
}
SPECS: dict[str, dict[str, Any]] = {
    "nothing asked": {},
    "one value": {"attributes": {"gender": ["female"], "handedness": {"left": 300, "right": 0}}},
    "weights": {"attributes": {"skin_tone": {"weights": {"tan": 2, "dark": 1}}}},
    "more attributes": {"attributes": {"ring": {"none": 290, "band": 10}, "age": ["20..30", "70"]}},
}


def rows(database: Database, dataset_id: UUID) -> Iterator[dict[str, Any]]:
    """Yield what the rows of a dataset's shards say, but for ids, times and objects' bytes."""
    with database.snapshot() as session:
        found = session.query(ShardRow).filter_by(dataset_id=dataset_id).order_by("number").all()
    for row in found:
        assert row.publication
        document = {**row.publication}
        for name in ("samples", "labels", "members"):
            assert set(document[name]) == {"key", "size_bytes", "sha256"}
            assert len(document[name]["sha256"]) == 64
            document[name] = document[name]["key"].replace(str(dataset_id), "dataset")
        names = ("number", "start", "stop", "status", "attempt", "failures", "progress")
        kept = {name: getattr(row, name) for name in names}
        unset = (row.lease_owner, row.lease_until, row.failure_reason)
        yield {**kept, "unset": unset, "publication": document}


@pytest.mark.parametrize("database_url", ["sqlite"], indirect=True)
def test_rows_are_those_of_a_worker(database: Database, tmp_path: Path) -> None:
    spec = parse_spec(SMALL)
    plan = Plan.of(spec)
    with database.transaction() as session:
        worked = datasets.create(session, spec, plan).dataset.id
    slot = runner(database, memory_store(), tmp_path, child="services.worker.render_child")
    assert slot.run_while_due(None, 100) == [Outcome.PUBLISHED] * 3
    filled = deliver(database, plan)
    assert list(rows(database, filled)) == list(rows(database, worked))
    with database.snapshot() as session:
        assert deliveries.tallies(session, filled) == deliveries.tallies(session, worked)
        sums = deliveries.counts(session, [filled, worked])
    assert sums[filled] == sums[worked]


@pytest.mark.parametrize("changes", SPECS.values(), ids=SPECS.keys())
def test_arrays_count_as_the_labels_do(changes: dict[str, Any]) -> None:
    plan = Plan.of(parse_spec({"count": 300, "seed": 2, **changes}))
    counting = Counting(plan)
    for images in (range(300), range(40, 60), [7]):
        cells = (plan.cell(index).as_dict() for index in images)
        assert counting.of(images) == tally(cells, plan.crossed)


def test_some_shards_have_gaps_and_redraws() -> None:
    plan = Plan.of(parse_spec({"count": 4 * GAP_EVERY, "images_per_shard": 4}))
    counting = Counting(plan)
    made = [publication_of(shard(cut.number), counting) for cut in plan.shards()]
    assert [gap.index for each in made for gap in each.gaps] == [4 * (GAP_EVERY - 1)]
    assert sum(len(each.redraws) for each in made) == GAP_EVERY // REDRAW_EVERY
    last = made[-1]
    assert last.image_count == last.tallies.values[f"muscle={plan.cell(0).muscle}"] == 3


def shard(number: int) -> Shard:
    start, stop, leased = 4 * number, 4 * number + 4, ShardStatus.LEASED
    return Shard(uuid4(), uuid4(), number, start, stop, leased, 1, 0, "w", None, None, None)
