"""What a lease promises, on SQLite and on Postgres."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from uuid import UUID

import pytest

from hi5_common.db import datasets, errors, events, shards, upkeep
from hi5_common.db.engine import Database
from hi5_common.domain import retry
from hi5_common.domain.records import Gap, Redraw, Shard, ShardStatus
from hi5_common.domain.retry import FailureKind
from tests.support import factories


def claimed(
    database: Database, owner: str = "w", lease_s: float = 60, hint: UUID | None = None
) -> Shard:
    with database.transaction() as session:
        shard = shards.claim(session, hint, owner, lease_s)
    assert shard is not None
    return shard


def seen(database: Database, shard: Shard) -> Shard:
    with database.snapshot() as session:
        return shards.get(session, shard.dataset_id, shard.number)


def kinds(database: Database, shard: Shard) -> list[str]:
    with database.snapshot() as session:
        history = events.of_dataset(session, shard.dataset_id, 100)
    return [event.kind for event in history if event.shard_number == shard.number]


def test_claim_leases_the_oldest_shard(database: Database) -> None:
    factories.dataset(database)
    shard = claimed(database)
    assert (shard.number, shard.attempt, shard.status) == (0, 1, ShardStatus.LEASED)
    assert shard.lease_owner == "w"
    assert kinds(database, shard) == ["claim"]


def test_claim_prefers_the_hint_but_does_not_need_it(database: Database) -> None:
    made = factories.dataset(database)
    with database.snapshot() as session:
        third = shards.of_dataset(session, made.id, 10)[2]
    assert claimed(database, hint=third.id).number == 2
    assert claimed(database, hint=third.id).number == 0
    assert claimed(database, hint=UUID(int=1)).number == 1
    with database.transaction() as session:
        assert shards.claim(session, third.id, "w", 60) is None


def test_no_two_claims_get_the_same_shard(database: Database) -> None:
    made = factories.dataset(database, count=24, size=1)
    start = threading.Barrier(6)

    def take(owner: int) -> list[int]:
        start.wait()
        return [claimed(database, owner=str(owner)).number for _ in range(4)]

    with ThreadPoolExecutor(6) as pool:
        numbers = [number for found in pool.map(take, range(6)) for number in found]
    assert sorted(numbers) == list(range(24))
    with database.snapshot() as session:
        assert datasets.get(session, made.id).shards_by_status == {ShardStatus.LEASED: 24}


def test_finish_publishes_once_and_may_be_sent_again(database: Database) -> None:
    factories.dataset(database)
    shard = claimed(database)
    published = factories.publication(shard)
    for _ in range(2):
        with database.transaction() as session:
            shards.finish(session, shard.id, shard.attempt, "w", published)
    assert seen(database, shard).publication == published
    assert kinds(database, shard) == ["claim", "finish"]


def test_finish_refuses_other_bytes_from_the_same_attempt(database: Database) -> None:
    factories.dataset(database)
    shard = claimed(database)
    published = factories.publication(shard)
    with database.transaction() as session:
        shards.finish(session, shard.id, shard.attempt, "w", published)
    other = replace(published, samples=replace(published.samples, sha256="b" * 64))
    with pytest.raises(errors.LeaseLost), database.transaction() as session:
        shards.finish(session, shard.id, shard.attempt, "w", other)
    assert seen(database, shard).publication == published


def test_finish_counts_the_images(database: Database) -> None:
    factories.dataset(database)
    shard = claimed(database)
    short = replace(factories.publication(shard), image_count=1)
    with pytest.raises(errors.WrongCount), database.transaction() as session:
        shards.finish(session, shard.id, shard.attempt, "w", short)
    assert seen(database, shard).status is ShardStatus.LEASED


def test_a_zombie_is_fenced_off(database: Database) -> None:
    factories.dataset(database, count=2)
    old = claimed(database, owner="old", lease_s=0.01)
    time.sleep(0.05)
    with database.transaction() as session:
        assert [lease.owner for lease in upkeep.sweep_expired(session)] == ["old"]
    new = claimed(database, owner="new")
    assert new.attempt == 2
    for act in (
        lambda s: shards.renew(s, old.id, old.attempt, "old", 60, 1),
        lambda s: shards.finish(s, old.id, old.attempt, "old", factories.publication(old)),
        lambda s: shards.fail(s, old.id, old.attempt, "old", FailureKind.STORE, "x"),
        lambda s: shards.release(s, old.id, old.attempt, "old"),
        lambda s: shards.cancel(s, old.id, old.attempt, "old"),
    ):
        with pytest.raises(errors.LeaseLost), database.transaction() as session:
            act(session)
    with database.transaction() as session:
        shards.finish(session, new.id, new.attempt, "new", factories.publication(new))
    with pytest.raises(errors.LeaseLost), database.transaction() as session:
        shards.finish(session, old.id, old.attempt, "old", factories.publication(old))
    assert seen(database, new).publication == factories.publication(new)


def test_an_owner_cannot_use_anothers_attempt(database: Database) -> None:
    factories.dataset(database)
    shard = claimed(database, owner="mine")
    with pytest.raises(errors.LeaseLost), database.transaction() as session:
        shards.renew(session, shard.id, shard.attempt, "yours", 60, 1)


def test_a_late_renewal_counts_while_nobody_took_the_shard(database: Database) -> None:
    factories.dataset(database)
    shard = claimed(database, lease_s=0.01)
    time.sleep(0.05)
    with database.transaction() as session:
        shards.renew(session, shard.id, shard.attempt, "w", 60, 1)
    with database.transaction() as session:
        assert upkeep.sweep_expired(session) == []
    assert seen(database, shard).progress == 1


def test_a_first_lost_lease_is_due_again_at_once(database: Database) -> None:
    factories.dataset(database, count=2)
    shard = claimed(database, lease_s=0.01)
    time.sleep(0.05)
    with database.transaction() as session:
        (swept,) = upkeep.sweep_expired(session)
    assert swept.status is ShardStatus.PENDING
    assert claimed(database).attempt == shard.attempt + 1
    assert kinds(database, shard) == ["claim", "expire", "claim"]


def test_a_failed_attempt_waits_before_the_next(database: Database) -> None:
    factories.dataset(database, count=2)
    shard = claimed(database)
    with database.transaction() as session:
        status = shards.fail(session, shard.id, 1, "w", FailureKind.STORE, "store away")
    assert status is ShardStatus.PENDING
    assert seen(database, shard).failure_reason == "store: store away"
    with database.transaction() as session:
        assert shards.claim(session, shard.id, "w", 60) is None
        assert shards.pending_to_ring(session, 10, 30) == []


def test_attempts_are_bounded(database: Database) -> None:
    factories.dataset(database, count=2)
    shard = claimed(database)
    for attempt in range(1, retry.MAX_FAILURES + 1):
        shard = shard if attempt == 1 else claimed(database)
        with database.transaction() as session:
            shards.fail(session, shard.id, shard.attempt, "w", FailureKind.WORKER, "no GPU")
        make_due(database, shard)
    assert shard.attempt == retry.MAX_FAILURES
    assert seen(database, shard).status is ShardStatus.FAILED
    assert seen(database, shard).failure_reason == "worker: no GPU"
    assert kinds(database, shard)[-2:] == ["claim", "fail"]


def test_handing_back_does_not_count_as_a_failure(database: Database) -> None:
    factories.dataset(database, count=2)
    shard = claimed(database)
    for _ in range(retry.MAX_FAILURES + 2):
        with database.transaction() as session:
            shards.release(session, shard.id, shard.attempt, "w")
        shard = claimed(database)
    assert shard.attempt == retry.MAX_FAILURES + 3


def test_shards_are_rung_for_once_in_a_while(database: Database) -> None:
    factories.dataset(database)
    with database.transaction() as session:
        first = shards.pending_to_ring(session, 2, 30)
    with database.transaction() as session:
        rest = shards.pending_to_ring(session, 10, 30)
    with database.transaction() as session:
        assert shards.pending_to_ring(session, 10, 30) == []
        assert sorted(shards.pending_to_ring(session, 10, 0)) == sorted([*first, *rest])
    assert (len(first), len(rest)) == (2, 1)


def test_containing_finds_the_shard_of_an_image(database: Database) -> None:
    made = factories.dataset(database, count=7, size=3)
    with database.snapshot() as session:
        found = [shards.containing(session, made.id, index).number for index in range(7)]
        for index in (-1, 7):
            with pytest.raises(errors.ImageNotFound, match=r"from 0 to 6"):
                shards.containing(session, made.id, index)
    assert found == [0, 0, 0, 1, 1, 1, 2]


def test_pages_of_shards(database: Database) -> None:
    made = factories.dataset(database, count=5, size=1)
    with database.snapshot() as session:
        first = shards.of_dataset(session, made.id, 2)
        second = shards.of_dataset(session, made.id, 2, after_number=first[-1].number)
    assert [shard.number for shard in (*first, *second)] == [0, 1, 2, 3]


def test_a_transition_and_its_event_stand_or_fall_together(database: Database) -> None:
    factories.dataset(database)
    with pytest.raises(ZeroDivisionError), database.transaction() as session:
        shard = shards.claim(session, None, "w", 60)
        raise ZeroDivisionError
    assert shard is not None
    assert seen(database, shard).status is ShardStatus.PENDING
    assert kinds(database, shard) == []


def make_due(database: Database, shard: Shard) -> None:
    """Let the time until the next attempt pass."""
    from hi5_common.db.tables import ShardRow

    with database.transaction() as session:
        row = session.get_one(ShardRow, shard.id)
        row.not_before = row.changed_at


def test_shards_in_trouble_are_those_published_with_gaps_or_redraws(database: Database) -> None:
    made = factories.dataset(database)
    other = factories.dataset(database, seed=1)
    gap, redraw = Gap(3, "it broke"), Redraw(4, 2, "too dark")
    for shard in (claimed(database, hint=row) for row in _ids(database, made.id, other.id)):
        whole = factories.publication(shard)
        published = {
            1: replace(whole, image_count=1, gaps=(gap,)),
            2: replace(whole, redraws=(redraw,)),
        }
        mine = shard.dataset_id == made.id
        with database.transaction() as session:
            found = published.get(shard.number, whole) if mine else whole
            shards.finish(session, shard.id, shard.attempt, "w", found)
    with database.snapshot() as session:
        troubled = shards.in_trouble(session, made.id, 10)
        first = shards.in_trouble(session, made.id, 1)
        assert shards.in_trouble(session, other.id, 10) == []
    assert [shard.number for shard in troubled] == [1, 2]
    assert [shard.publication.gaps for shard in troubled if shard.publication] == [(gap,), ()]
    assert [shard.number for shard in first] == [1]


def _ids(database: Database, *datasets_: UUID) -> list[UUID]:
    with database.snapshot() as session:
        return [row.id for one in datasets_ for row in shards.of_dataset(session, one, 10)]
