"""A dataset that extends a complete one has its images from the first, and keeps them there."""

from collections.abc import Sequence
from dataclasses import replace

import pytest
from sqlalchemy import select, text

from hi5_common.db import datasets, deliveries, errors, events, extending, migrate, shards
from hi5_common.db.engine import Database, open_database
from hi5_common.db.tables import DatasetRow
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Dataset, DatasetStatus, Redraw, Shard, ShardStatus
from hi5_common.domain.sharding import ShardRange
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.tallies import tally
from tests.support import factories

SMALL = factories.spec(count=10, size=4, seed=3)
LARGE = factories.spec(count=25, size=6, seed=3, extends=SMALL.model_dump(mode="json"))


class CutElsewhere(Plan):
    """A plan of the same images in other shards, as another version of hi5 may have it."""

    def shards(self) -> tuple[ShardRange, ...]:
        return (ShardRange(0, 0, self.count),)


def submitted(database: Database, spec: DatasetSpec, kind: type[Plan] = Plan) -> Dataset:
    with database.transaction() as session:
        return datasets.create(session, spec, kind.of(spec)).dataset


def deliver(
    database: Database, spec: DatasetSpec, most: int = 100, redraws: Sequence[Redraw] = ()
) -> None:
    """Publish pending shards as a worker does, images as the plan of a spec has them."""
    plan = Plan.of(spec)
    for _ in range(most):
        with database.transaction() as session:
            shard = shards.claim(session, None, "worker", 60)
            if shard is None:
                return
            cells = (cell.as_dict() for cell in plan.cells(shard.start, shard.stop))
            published = factories.publication(shard, tally(cells, plan.crossed))
            mine = tuple(one for one in redraws if shard.start <= one.index < shard.stop)
            published = replace(published, redraws=mine)
            shards.finish(session, shard.id, shard.attempt, "worker", published)


def extended(database: Database, dataset: Dataset) -> object:
    with database.snapshot() as session:
        return session.scalar(select(DatasetRow.extends_id).where(DatasetRow.id == dataset.id))


def kinds(database: Database, dataset: Dataset) -> list[str]:
    with database.snapshot() as session:
        return [event.kind for event in events.of_dataset(session, dataset.id, limit=10)]


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
    assert kinds(database, grown) == ["create", "take_over"]
    assert extended(database, grown) == base.id


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


def test_nothing_is_said_to_be_taken_of_what_was_cut_elsewhere(database: Database) -> None:
    base = submitted(database, SMALL, CutElsewhere)
    deliver(database, SMALL)
    grown = submitted(database, LARGE)
    assert grown.images_done == 0
    assert kinds(database, grown) == ["create"]
    assert extended(database, grown) is None
    with database.transaction() as session:
        datasets.delete(session, base.id)


def test_what_is_taken_over_counts_as_it_was_published(database: Database) -> None:
    base = submitted(database, SMALL)
    deliver(database, factories.spec(count=10, size=4, seed=4))  # not what is planned now
    grown = submitted(database, LARGE)
    assert grown.images_done == 10
    with database.snapshot() as session:
        found = deliveries.tallies(session, grown.id)
        assert found == deliveries.tallies(session, base.id)
    assert found != Plan.of(LARGE).tallies_of_first(10)


ONE_RING = factories.spec(count=10, size=4, seed=3, attributes={"ring": ["none"]})
RINGS = factories.spec(
    count=25,
    size=6,
    seed=3,
    attributes={"ring": ["none", "gem"]},
    extends=ONE_RING.model_dump(mode="json"),
)


def test_pairs_of_what_only_now_has_a_choice_are_counted_too(database: Database) -> None:
    submitted(database, ONE_RING)
    deliver(database, ONE_RING)
    grown = submitted(database, RINGS)
    assert grown.images_done == 10
    deliver(database, RINGS)
    with database.snapshot() as session:
        assert deliveries.tallies(session, grown.id) == Plan.of(RINGS).tallies()


def test_where_pairs_cannot_be_told_from_what_was_published_nothing_is_taken(
    database: Database,
) -> None:
    submitted(database, ONE_RING)
    deliver(database, factories.spec(count=10, size=4, seed=4))
    grown = submitted(database, RINGS)
    assert grown.images_done == 0
    assert kinds(database, grown) == ["create"]


def test_redraws_are_taken_over_and_named(database: Database) -> None:
    base = submitted(database, SMALL)
    deliver(database, SMALL, redraws=[Redraw(5, 2, "too dark")])
    grown = submitted(database, LARGE)
    for each in (base, grown):
        with database.snapshot() as session:
            (troubled,) = shards.in_trouble(session, each.id, 10)
        assert troubled.number == 1
        assert troubled.publication
        assert troubled.publication.redraws == (Redraw(5, 2, "too dark"),)


@pytest.mark.integration
def test_a_worker_can_finish_while_its_dataset_is_about_to_be_deleted(
    postgres_url: str,
) -> None:
    """Neither waits for what the other has: who deletes has the row, then needs the shards."""
    migrate.upgrade(postgres_url)
    database = open_database(postgres_url)
    try:
        base = submitted(database, SMALL)
        with database.transaction() as deleting:
            assert not extending.is_extended(deleting, base.id)
            with database.transaction() as session:
                session.execute(text("SET LOCAL lock_timeout = '1s'"))
                shard = shards.claim(session, None, "worker", 60)
                assert shard
                published = factories.publication(shard)
                shards.finish(session, shard.id, shard.attempt, "worker", published)
            datasets.delete(deleting, base.id)
    finally:
        database.dispose()


@pytest.mark.integration
def test_who_extends_waits_for_who_deletes(postgres_url: str) -> None:
    migrate.upgrade(postgres_url)
    database = open_database(postgres_url)
    try:
        base = submitted(database, SMALL)
        deliver(database, SMALL)
        with database.transaction() as deleting:
            assert not extending.is_extended(deleting, base.id)
            with pytest.raises(errors.DatabaseUnavailable), database.transaction() as session:
                session.execute(text("SET LOCAL lock_timeout = '50ms'"))
                datasets.create(session, LARGE, Plan.of(LARGE))
    finally:
        database.dispose()
