"""What datasets promise, on SQLite and on Postgres."""

from datetime import UTC, datetime
from uuid import UUID

import pytest

from hi5_common.db import datasets, deliveries, errors, events, shards, upkeep
from hi5_common.db.engine import Database
from hi5_common.domain.records import DatasetStatus, ShardStatus, Tallies
from hi5_common.domain.retry import FailureKind
from tests.support import factories

NOBODY = UUID(int=7)


def test_create_cuts_shards_and_derives_the_state(database: Database) -> None:
    made = factories.dataset(database, count=7, size=3)
    with database.snapshot() as session:
        cut = shards.of_dataset(session, made.id, limit=10)
        history = events.of_dataset(session, made.id, limit=10)
    assert [(s.number, s.start, s.stop) for s in cut] == [(0, 0, 3), (1, 3, 6), (2, 6, 7)]
    assert made.status is DatasetStatus.PENDING
    assert made.shards_by_status == {ShardStatus.PENDING: 3}
    assert made.spec == factories.spec(7, 3)
    assert [event.kind for event in history] == ["create"]


def test_now_can_be_given(database: Database) -> None:
    moment = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    with database.transaction() as session:
        made = datasets.create(session, factories.spec(), factories.Cut(6, 2), now=moment)
    assert made.dataset.created_at == moment


def test_the_same_key_and_spec_give_the_same_dataset(database: Database) -> None:
    made = []
    for _ in range(2):
        with database.transaction() as session:
            made.append(
                datasets.create(session, factories.spec(), factories.Cut(6, 2), idempotency_key="k")
            )
    assert [each.created for each in made] == [True, False]
    assert made[0].dataset == made[1].dataset
    with database.snapshot() as session:
        assert len(datasets.page(session, 10)) == 1


def test_the_same_key_with_another_spec_is_refused(database: Database) -> None:
    with database.transaction() as session:
        datasets.create(session, factories.spec(), factories.Cut(6, 2), idempotency_key="k")
    with (
        pytest.raises(errors.IdempotencyConflict, match="Idempotency-Key"),
        database.transaction() as session,
    ):
        datasets.create(session, factories.spec(8), factories.Cut(8, 2), idempotency_key="k")


def test_pages_go_from_new_to_old(database: Database) -> None:
    made = [factories.dataset(database, seed=seed).id for seed in range(3)]
    made.sort(reverse=True)  # ids made in the same millisecond sort by chance
    with database.snapshot() as session:
        first = [each.id for each in datasets.page(session, 2)]
        rest = [each.id for each in datasets.page(session, 2, first[-1])]
    assert [*first, *rest] == made


@pytest.mark.parametrize(
    "act", [datasets.get, datasets.spec, datasets.request_cancel, datasets.retry_failed]
)
def test_an_unknown_dataset_is_not_found(database: Database, act: object) -> None:
    assert callable(act)
    with pytest.raises(errors.DatasetNotFound), database.transaction() as session:
        act(session, NOBODY)


def test_cancel_stops_pending_shards_and_tells_the_worker(database: Database) -> None:
    made = factories.dataset(database)
    with database.transaction() as session:
        claimed = shards.claim(session, None, "w", 60)
    assert claimed
    for _ in range(2):
        with database.transaction() as session:
            cancelled = datasets.request_cancel(session, made.id)
        assert cancelled.status is DatasetStatus.CANCELLED
        assert cancelled.shards_by_status == {ShardStatus.CANCELLED: 2, ShardStatus.LEASED: 1}
    with database.transaction() as session:
        assert shards.renew(session, claimed.id, 1, "w", 60, 0).cancel_requested
        shards.cancel(session, claimed.id, 1, "w")
    with database.transaction() as session:
        assert datasets.get(session, made.id).shards_by_status == {ShardStatus.CANCELLED: 3}
        assert shards.claim(session, None, "w", 60) is None


def test_a_shard_that_fails_while_cancelled_is_not_tried_again(database: Database) -> None:
    made = factories.dataset(database, count=2)
    with database.transaction() as session:
        claimed = shards.claim(session, None, "w", 60)
        assert claimed
        datasets.request_cancel(session, made.id)
        status = shards.fail(session, claimed.id, 1, "w", FailureKind.STORE, "away")
    assert status is ShardStatus.CANCELLED


def test_a_shard_released_while_cancelled_is_settled_by_the_keeper(database: Database) -> None:
    made = factories.dataset(database, count=2)
    with database.transaction() as session:
        claimed = shards.claim(session, None, "w", 60)
        assert claimed
        datasets.request_cancel(session, made.id)
        shards.release(session, claimed.id, 1, "w")
    with database.transaction() as session:
        assert upkeep.settle_cancelled(session) == 1
    with database.snapshot() as session:
        assert datasets.get(session, made.id).shards_by_status == {ShardStatus.CANCELLED: 1}


def test_retry_revives_failed_shards_with_a_clean_count(database: Database) -> None:
    made = factories.dataset(database, count=2)
    with database.transaction() as session:
        claimed = shards.claim(session, None, "w", 60)
        assert claimed
        shards.fail(session, claimed.id, 1, "w", FailureKind.IMAGE, "image 1 failed")
    with database.transaction() as session:
        assert datasets.get(session, made.id).status is DatasetStatus.FAILED
        assert datasets.retry_failed(session, made.id) == 1
    with database.transaction() as session:
        again = shards.claim(session, None, "w", 60)
    assert again
    assert again.attempt == 2
    assert again.failure_reason is None


def test_delete_takes_the_rows_and_the_lease(database: Database) -> None:
    made = factories.dataset(database)
    with database.transaction() as session:
        claimed = shards.claim(session, None, "w", 60)
        assert claimed
        datasets.delete(session, made.id)
    with pytest.raises(errors.LeaseLost), database.transaction() as session:
        shards.renew(session, claimed.id, 1, "w", 60, 0)
    with database.snapshot() as session:
        assert datasets.page(session, 10) == []
        assert upkeep.deleted_datasets(session) == [made.id]


def test_tallies_add_up_over_published_shards(database: Database) -> None:
    made = factories.dataset(database)
    for _ in range(2):
        with database.transaction() as session:
            claimed = shards.claim(session, None, "w", 60)
            assert claimed
            counts = Tallies({"gender=male": 2}, {"gender=male&skin_tone=tan": 1})
            published = factories.publication(claimed, counts)
            shards.finish(session, claimed.id, claimed.attempt, "w", published)
    with database.snapshot() as session:
        assert deliveries.tallies(session, made.id) == Tallies(
            {"gender=male": 4}, {"gender=male&skin_tone=tan": 2}
        )
        assert datasets.get(session, made.id).images_done == 4


def test_ten_thousand_shards(database: Database) -> None:
    made = factories.dataset(database, count=10_000, size=1)
    assert made.shards_by_status == {ShardStatus.PENDING: 10_000}
    with database.snapshot() as session:
        assert shards.containing(session, made.id, 9_999).number == 9_999
