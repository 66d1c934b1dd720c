"""What failed is kept, with the scene it failed at; a machine that only fails is kept from work."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from hi5_common.db import datasets, failures, shards, workers
from hi5_common.db.engine import Database
from hi5_common.db.errors import WorkerNotFound
from hi5_common.domain.failures import Failure, FailureOf
from hi5_common.domain.records import Dataset, ShardStatus
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.workers import BAD_SHARDS, new_owner
from hi5_common.storage.open import memory_store
from services.worker.fleet.shard_runner import Outcome, ShardRunner
from tests.support import factories
from tests.support.runners import runner


def kept(database: Database, dataset: Dataset, limit: int = 100) -> list[Failure]:
    with database.snapshot() as session:
        return failures.of_dataset(session, dataset.id, limit)


def test_a_gap_is_kept_with_its_log(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=4, size=4, name="crash_always 2")
    assert runner(database, memory_store(), tmp_path).run_next(None) is Outcome.PUBLISHED
    (failure,) = kept(database, made)
    assert (failure.of, failure.index, failure.draw) == (FailureOf.GAP, 2, 0)
    assert (failure.shard_number, failure.attempt, failure.owner) == (0, 1, "w")
    assert "failed 5 times" in failure.reason
    assert "killed by SIGSEGV" in failure.reason
    assert "log:" not in failure.reason
    assert failure.log == "(empty)"


def test_a_redraw_is_kept_with_the_draw_that_failed(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2, size=2, name="crash_first_draw 1")
    runner(database, memory_store(), tmp_path).run_next(None)
    (failure,) = kept(database, made)
    assert (failure.of, failure.index, failure.draw) == (FailureOf.REDRAW, 1, 0)


def test_an_attempt_is_kept_with_the_end_of_the_childs_log(
    database: Database, tmp_path: Path
) -> None:
    made = factories.dataset(database, count=2, size=2, name="never_starts")
    runner(database, memory_store(), tmp_path).run_next(None)
    (failure,) = kept(database, made)
    assert (failure.of, failure.kind, failure.index) == (FailureOf.ATTEMPT, "child_start", None)
    assert failure.log.endswith("no GPU here")


def test_an_attempt_names_the_image_that_failed_most(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=1, size=1, name="crash_always 0")
    runner(database, memory_store(), tmp_path).run_next(None)
    (failure,) = kept(database, made)
    assert (failure.of, failure.kind, failure.index) == (FailureOf.ATTEMPT, "image", 0)


def test_a_lease_that_ran_out_is_kept_too(database: Database) -> None:
    from hi5_common.db import upkeep

    made = factories.dataset(database)
    with database.transaction() as session:
        shards.claim(session, None, "silent", -1)
        upkeep.sweep_expired(session)
    (failure,) = kept(database, made)
    assert (failure.kind, failure.owner) == ("lease_expired", "silent")


def test_the_newest_are_kept(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(failures, "KEPT", 3)
    made, other = (factories.dataset(database, count=14, size=2, seed=seed) for seed in (1, 2))
    for number in range(5):
        fail_one(database, str(number))
    found = kept(database, made)
    assert [failure.reason for failure in found] == ["4", "3", "2"]
    with database.snapshot() as session:
        older = failures.of_dataset(session, made.id, 10, before=found[1].id)
    assert older == found[2:]
    assert kept(database, other) == []


def test_they_go_with_their_dataset(database: Database) -> None:
    made = factories.dataset(database)
    fail_one(database, "broken")
    with database.transaction() as session:
        datasets.delete(session, made.id)
    assert kept(database, made) == []


def fail_one(database: Database, reason: str) -> None:
    with database.transaction() as session:
        shard = shards.claim(session, None, "w", 60)
        assert shard
        shards.fail(session, shard.id, shard.attempt, "w", FailureKind.INTERNAL, reason)


def slot(database: Database, folder: Path, name: str, child: str | None = None) -> ShardRunner:
    """Return a slot of a machine; its child never starts unless another is named."""
    made = runner(database, memory_store(), folder / name, owner=new_owner(name))
    changes = {"worker_name": name, "child_module": child or "tests.support.no_such_child"}
    return replace(made, settings=made.settings.model_copy(update=changes))


def good_slot(database: Database, folder: Path, name: str) -> ShardRunner:
    return slot(database, folder, name, "tests.support.stand_in_child")


def blocked(database: Database, name: str) -> str | None:
    with database.snapshot() as session:
        return workers.blocked(session, name)


def outcomes_of(own: ShardRunner, times: int) -> Sequence[Outcome | None]:
    return [own.run_next(None) for _ in range(times)]


def test_a_machine_with_three_bad_shards_claims_nothing_and_another_goes_on(
    database: Database, tmp_path: Path
) -> None:
    made = factories.dataset(database, count=10, size=2)
    bad, good = slot(database, tmp_path, "bad"), good_slot(database, tmp_path, "good")
    assert outcomes_of(bad, BAD_SHARDS + 1) == [Outcome.FAILED] * BAD_SHARDS + [None]
    assert "3 different shards failed here" in str(blocked(database, "bad"))
    another_process = replace(bad, owner=new_owner("bad"))
    assert another_process.run_next(None) is None
    assert good.run_while_due(None, 10) == [Outcome.PUBLISHED] * 2  # three wait for another try
    with database.snapshot() as session:
        states = [shard.status for shard in shards.of_dataset(session, made.id, 10)]
        (worker, *_) = workers.all_of_them(session)
    assert states == [ShardStatus.PENDING] * 3 + [ShardStatus.DONE] * 2
    assert (worker.name, worker.failed_shards, worker.alive) == ("bad", 3, True)
    assert worker.blocked_until is not None


def test_an_operator_lifts_a_block(database: Database, tmp_path: Path) -> None:
    factories.dataset(database, count=10, size=2)
    bad = slot(database, tmp_path, "bad")
    outcomes_of(bad, BAD_SHARDS)
    with database.transaction() as session:
        lifted = workers.unblock(session, "bad")
    assert (lifted.blocked_until, lifted.failed_shards) == (None, 0)
    mended = replace(good_slot(database, tmp_path, "bad"), owner=new_owner("bad"))
    assert mended.run_next(None) is Outcome.PUBLISHED
    with pytest.raises(WorkerNotFound, match="nobody"), database.transaction() as session:
        workers.unblock(session, "nobody")


def test_a_block_ends_and_the_next_one_lasts_twice_as_long(database: Database) -> None:
    made = factories.dataset(database, count=20, size=2)
    with database.snapshot() as session:
        ids = [shard.id for shard in shards.of_dataset(session, made.id, 10)]
    with database.transaction() as session:
        told = [workers.failed(session, "m", each, FailureKind.WORKER, "no", -1) for each in ids]
    # The first one is over at once, as are those after it: each failure is a new block.
    assert told == [False, False, True, True, True, True, True, True, True, True]
    with database.transaction() as session:
        workers.succeeded(session, "m")
        told = [workers.failed(session, "m", each, FailureKind.WORKER, "no", 60) for each in ids]
        blocked_for = [worker.blocked_until for worker in workers.all_of_them(session)]
    assert told == [False, False, True, *[False] * 7]
    assert blocked_for[0] is not None


def test_the_same_shard_again_and_faults_of_others_do_not_count(database: Database) -> None:
    made = factories.dataset(database, count=20, size=2)
    with database.snapshot() as session:
        ids = [shard.id for shard in shards.of_dataset(session, made.id, 10)]
    with database.transaction() as session:
        for kind in (FailureKind.IMAGE, FailureKind.STORE, FailureKind.LEASE_EXPIRED):
            assert not any(workers.failed(session, "m", each, kind, "no", 60) for each in ids)
        for _ in range(5):
            assert not workers.failed(session, "m", ids[0], FailureKind.WORKER, "no", 60)
        workers.failed(session, "m", ids[1], FailureKind.WORKER, "no", 60)
        workers.succeeded(session, "m")
        assert not workers.failed(session, "m", ids[2], FailureKind.WORKER, "no", 60)


def test_a_dataset_that_fails_everywhere_blocks_nobody(database: Database, tmp_path: Path) -> None:
    factories.dataset(database, count=40, size=2)
    slots = [slot(database, tmp_path, name) for name in ("a", "b")]
    for _ in range(4):
        assert [each.run_next(None) for each in slots] == [Outcome.FAILED] * 2
    assert blocked(database, "a") is None
    assert blocked(database, "b") is None


def test_a_machine_says_what_it_does(database: Database) -> None:
    made = factories.dataset(database, count=4, size=4)
    with database.transaction() as session:
        workers.seen(session, "here", 2)
        owner = new_owner("here")
        shard = shards.claim(session, None, owner, 60)
        assert shard
        shards.renew(session, shard.id, 1, owner, 60, 3)
        (worker,) = workers.all_of_them(session)
    (busy,) = worker.busy
    assert (worker.name, worker.slots, worker.blocked_until) == ("here", 2, None)
    assert (busy.dataset_id, busy.shard_number, busy.progress, busy.size) == (made.id, 0, 3, 4)
