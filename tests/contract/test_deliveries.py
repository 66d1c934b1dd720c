"""The running sum of a dataset, on SQLite and on Postgres: nothing is lost or added twice."""

import contextlib
from concurrent.futures import ThreadPoolExecutor
from uuid import UUID

import pytest

from hi5_common.db import datasets, deliveries, errors, shards
from hi5_common.db.engine import Database
from hi5_common.domain.records import DatasetStatus, Shard, Tallies
from tests.support import factories

WORKERS = 8
SHARDS = 24


def claimed(database: Database) -> Shard:
    with database.transaction() as session:
        shard = shards.claim(session, None, "w", 60)
    assert shard
    return shard


def finish(database: Database, shard: Shard) -> None:
    tallies = Tallies({"gender=male": 2, f"shard={shard.number}": 1}, {})
    with database.transaction() as session:
        published = factories.publication(shard, tallies)
        shards.finish(session, shard.id, shard.attempt, "w", published)


def test_workers_that_finish_at_once_lose_no_count(database: Database) -> None:
    made = factories.dataset(database, count=2 * SHARDS, size=2)
    held = [claimed(database) for _ in range(SHARDS)]
    with ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(lambda shard: finish(database, shard), held))
    once_each = {f"shard={number}": 1 for number in range(SHARDS)}
    with database.snapshot() as session:
        tallies = deliveries.tallies(session, made.id)
        assert tallies.values == {"gender=male": 2 * SHARDS} | once_each
        assert datasets.get(session, made.id).images_done == 2 * SHARDS


def test_a_finish_that_is_rolled_back_or_sent_again_counts_once(database: Database) -> None:
    made = factories.dataset(database)
    shard = claimed(database)
    with pytest.raises(ZeroDivisionError), database.transaction() as session:
        published = factories.publication(shard, Tallies({"gender=male": 2}, {}))
        shards.finish(session, shard.id, shard.attempt, "w", published)
        raise ZeroDivisionError
    with database.snapshot() as session:
        assert deliveries.tallies(session, made.id) == Tallies({}, {})
    for _ in range(3):
        finish(database, shard)
    with database.snapshot() as session:
        assert deliveries.tallies(session, made.id).values["gender=male"] == 2
        assert datasets.get(session, made.id).images_done == 2


def test_gaps_are_counted_as_each_shard_is_published(database: Database) -> None:
    made = factories.dataset(database, count=6, size=2)
    told = []
    for missing in ((), (2,), (5,)):
        shard = claimed(database)
        with database.transaction() as session:
            published = factories.publication(shard, missing=missing)
            shards.finish(session, shard.id, shard.attempt, "w", published)
        with database.snapshot() as session:
            seen = datasets.get(session, made.id)
        told.append((seen.status, seen.images_done, seen.images_missing))
    running = DatasetStatus.RUNNING
    ended = DatasetStatus.COMPLETE_WITH_GAPS
    assert told == [(running, 2, 0), (running, 3, 1), (ended, 4, 2)]


def test_finishing_while_the_dataset_is_deleted_blocks_nobody(database: Database) -> None:
    for _ in range(4):
        made = factories.dataset(database, count=2 * WORKERS, size=2)
        held = [claimed(database) for _ in range(WORKERS)]

        def end(shard: Shard | None, dataset_id: UUID = made.id) -> None:
            if shard is None:
                with database.transaction() as session:
                    datasets.delete(session, dataset_id)
                return
            with contextlib.suppress(errors.LeaseLost):
                finish(database, shard)

        with ThreadPoolExecutor(WORKERS + 1) as pool:
            list(pool.map(end, [*held[:4], None, *held[4:]]))
        with database.snapshot() as session, pytest.raises(errors.DatasetNotFound):
            deliveries.tallies(session, made.id)


def test_a_snapshot_sees_one_moment(database: Database) -> None:
    made = factories.dataset(database)
    shard = claimed(database)
    with database.snapshot() as session:
        before = datasets.get(session, made.id)
        finish(database, shard)
        session.expire_all()
        assert datasets.get(session, made.id) == before
        assert deliveries.tallies(session, made.id) == Tallies({}, {})
