"""A dataset that extends a complete one has its images from the first, and keeps them there."""

import pytest

from hi5_common.db import datasets, deliveries, errors, events, shards
from hi5_common.db.engine import Database
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Dataset, DatasetStatus, Shard, ShardStatus
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.tallies import tally
from tests.support import factories

SMALL = factories.spec(count=10, size=4, seed=3)
LARGE = factories.spec(count=25, size=6, seed=3, extends=SMALL.model_dump(mode="json"))


def submitted(database: Database, spec: DatasetSpec) -> Dataset:
    with database.transaction() as session:
        return datasets.create(session, spec, Plan.of(spec)).dataset


def deliver(database: Database, spec: DatasetSpec, most: int = 100) -> None:
    """Publish pending shards as a worker does, images as the plan has them."""
    plan = Plan.of(spec)
    for _ in range(most):
        with database.transaction() as session:
            shard = shards.claim(session, None, "worker", 60)
            if shard is None:
                return
            cells = (cell.as_dict() for cell in plan.cells(shard.start, shard.stop))
            published = factories.publication(shard, tally(cells, plan.crossed))
            shards.finish(session, shard.id, shard.attempt, "worker", published)


def shards_of(database: Database, dataset: Dataset) -> list[Shard]:
    with database.snapshot() as session:
        return list(shards.of_dataset(session, dataset.id, limit=50))


def test_images_of_a_complete_dataset_are_taken_over(database: Database) -> None:
    base = submitted(database, SMALL)
    deliver(database, SMALL)
    grown = submitted(database, LARGE)
    assert grown.images_done == 10
    assert grown.status is DatasetStatus.RUNNING
    before, after = shards_of(database, base), shards_of(database, grown)
    starts = [0, 4, 8, 10, 16, 22]
    assert [(s.start, s.stop) for s in after] == list(zip(starts, [*starts[1:], 25], strict=True))
    assert [s.publication for s in after[:3]] == [s.publication for s in before]
    assert {s.status for s in after[3:]} == {ShardStatus.PENDING}
    with database.snapshot() as session:
        kinds = [event.kind for event in events.of_dataset(session, grown.id, limit=10)]
    assert kinds == ["create", "take_over"]


def test_what_is_delivered_adds_up_to_the_plan(database: Database) -> None:
    submitted(database, SMALL)
    deliver(database, SMALL)
    grown = submitted(database, LARGE)
    deliver(database, LARGE)
    with database.snapshot() as session:
        assert deliveries.tallies(session, grown.id) == Plan.of(LARGE).tallies()
        assert datasets.get(session, grown.id).status is DatasetStatus.COMPLETE


@pytest.mark.parametrize("delivered", [0, 2])
def test_an_incomplete_dataset_is_rendered_again(database: Database, delivered: int) -> None:
    submitted(database, SMALL)
    deliver(database, SMALL, most=delivered)
    assert submitted(database, LARGE).images_done == 0


def test_another_dataset_of_the_same_size_is_not_taken(database: Database) -> None:
    other = factories.spec(count=10, size=4, seed=4)
    submitted(database, other)
    deliver(database, other)
    assert submitted(database, LARGE).images_done == 0


def test_a_dataset_with_gaps_is_not_taken(database: Database) -> None:
    submitted(database, SMALL)
    with database.transaction() as session:
        shard = shards.claim(session, None, "worker", 60)
        assert shard
        published = factories.publication(shard, missing=[shard.start])
        shards.finish(session, shard.id, shard.attempt, "worker", published)
    deliver(database, SMALL)
    assert submitted(database, LARGE).images_done == 0


def test_what_is_extended_cannot_be_deleted_before_what_extends_it(database: Database) -> None:
    base = submitted(database, SMALL)
    deliver(database, SMALL)
    grown = submitted(database, LARGE)
    with pytest.raises(errors.DatasetInUse), database.transaction() as session:
        datasets.delete(session, base.id)
    for each in (grown, base):
        with database.transaction() as session:
            datasets.delete(session, each.id)
