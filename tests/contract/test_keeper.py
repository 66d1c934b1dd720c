"""The keeper's duties, on SQLite and on Postgres."""

import hashlib
import time
from collections.abc import Sequence
from pathlib import Path
from uuid import UUID, uuid4

import pytest

from hi5_common.db import datasets, shards
from hi5_common.db.engine import Database
from hi5_common.domain import keys
from hi5_common.domain.records import Shard, ShardStatus
from hi5_common.domain.retry import FailureKind
from hi5_common.queue.errors import BrokerUnavailable
from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.storage.open import memory_store
from hi5_common.storage.port import ObjectStore
from services.worker.fleet.heartbeat import Heartbeat
from services.worker.keeper import Duty, Keeper
from tests.support import factories
from tests.support.runners import settings


def keeper(
    database: Database, folder: Path, store: ObjectStore | None = None, **changes: object
) -> Keeper:
    return Keeper(database, store or memory_store(), MemoryDoorbell(), settings(folder, **changes))


def claim(database: Database, lease_s: float = 60) -> Shard:
    with database.transaction() as session:
        shard = shards.claim(session, None, "w", lease_s)
    assert shard
    return shard


def put_attempt(store: ObjectStore, dataset_id: UUID, number: int, attempt: int) -> None:
    for name in (keys.SAMPLES, keys.LABELS, keys.MEMBERS):
        key = f"{keys.shard_prefix(dataset_id, number, attempt)}/{name}"
        store.put(key, b"x", hashlib.sha256(b"x").hexdigest())


def attempts(store: ObjectStore, dataset_id: UUID, number: int = 0) -> list[int]:
    parsed = [keys.parse_attempt(e.key) for e in store.list(keys.shard_folder(dataset_id, number))]
    return sorted({found.attempt for found in parsed if found})


def test_every_due_shard_is_rung_for(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database)
    own = keeper(database, tmp_path)
    assert own.dispatch() == 3
    assert own.dispatch() == 0
    with database.snapshot() as session:
        expected = [str(shard.id) for shard in shards.of_dataset(session, made.id, 10)]
    assert isinstance(own.doorbell, MemoryDoorbell)
    assert sorted(m["shard_id"] for m in own.doorbell.messages) == sorted(expected)


def test_lost_messages_are_rung_again(database: Database, tmp_path: Path) -> None:
    factories.dataset(database)
    own = keeper(database, tmp_path, ring_s=0.05)
    assert own.dispatch() == 3
    assert isinstance(own.doorbell, MemoryDoorbell)
    own.doorbell.messages.clear()
    time.sleep(0.1)
    assert own.dispatch() == 3


def test_no_more_messages_wait_than_allowed(database: Database, tmp_path: Path) -> None:
    factories.dataset(database, count=20, size=1)
    own = keeper(database, tmp_path, max_rings=8, ring_s=0.01)
    for _ in range(5):
        own.dispatch()
        time.sleep(0.02)
        assert own.doorbell.waiting() == 8


def test_two_keepers_ring_once(database: Database, tmp_path: Path) -> None:
    factories.dataset(database)
    rung = [keeper(database, tmp_path).dispatch() for _ in range(2)]
    assert rung == [3, 0]


def test_silent_workers_lose_their_shards(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database)
    claim(database, lease_s=0.01)
    claim(database, lease_s=60)
    time.sleep(0.05)
    own = keeper(database, tmp_path)
    assert own.sweep_leases() == 1
    assert own.sweep_leases() == 0
    with database.snapshot() as session:
        by_status = datasets.get(session, made.id).shards_by_status
    assert by_status == {ShardStatus.PENDING: 2, ShardStatus.LEASED: 1}


def test_objects_of_lost_attempts_go_and_published_ones_stay(
    database: Database, tmp_path: Path
) -> None:
    made = factories.dataset(database, count=2)
    store = memory_store()
    lost = claim(database)
    put_attempt(store, made.id, 0, lost.attempt)
    with database.transaction() as session:
        shards.release(session, lost.id, lost.attempt, "w")
    won = claim(database)
    put_attempt(store, made.id, 0, won.attempt)
    with database.transaction() as session:
        shards.finish(session, won.id, won.attempt, "w", factories.publication(won))
    own = keeper(database, tmp_path, store)
    assert own.sweep_objects() == 3
    assert attempts(store, made.id) == [2]
    assert own.sweep_objects() == 0


def test_a_running_attempt_keeps_its_objects(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2)
    store = memory_store()
    first = claim(database)
    with database.transaction() as session:
        shards.release(session, first.id, first.attempt, "w")
    running = claim(database)
    put_attempt(store, made.id, 0, running.attempt)
    assert keeper(database, tmp_path, store).sweep_objects() == 0
    assert attempts(store, made.id) == [2]


def test_objects_of_a_failed_shard_go(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2)
    store = memory_store()
    shard = claim(database)
    put_attempt(store, made.id, 0, 1)
    with database.transaction() as session:
        shards.fail(session, shard.id, 1, "w", FailureKind.IMAGE, "poison")
    assert keeper(database, tmp_path, store).sweep_objects() == 3


def test_orphans_are_left_alone_for_a_while(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2)
    store = memory_store()
    shard = claim(database)
    put_attempt(store, made.id, 0, 1)
    with database.transaction() as session:
        shards.fail(session, shard.id, 1, "w", FailureKind.IMAGE, "poison")
    assert keeper(database, tmp_path, store, orphan_grace_s=60).sweep_objects() == 0
    assert attempts(store, made.id) == [1]


def test_objects_of_a_deleted_dataset_go_and_strangers_stay(
    database: Database, tmp_path: Path
) -> None:
    made, stranger = factories.dataset(database), uuid4()
    store = memory_store()
    for dataset_id in (made.id, stranger):
        put_attempt(store, dataset_id, 0, 1)
    with database.transaction() as session:
        datasets.delete(session, made.id)
    own = keeper(database, tmp_path, store)
    assert own.sweep_objects() == 3
    put_attempt(store, made.id, 1, 1)  # a worker that did not know yet
    assert own.sweep_objects() == 3
    assert attempts(store, stranger) == [1]


class _BrokenDoorbell(MemoryDoorbell):
    def waiting(self) -> int:
        raise BrokerUnavailable

    def ring(self, shard_ids: Sequence[UUID]) -> None:
        raise BrokerUnavailable


def test_without_a_broker_nothing_counts_as_rung(database: Database, tmp_path: Path) -> None:
    factories.dataset(database)
    own = Keeper(database, memory_store(), _BrokenDoorbell(), settings(tmp_path))
    duty = Duty("dispatch", 1, own.dispatch)
    duty.run()
    assert not duty.healthy
    assert keeper(database, tmp_path).dispatch() == 3


def test_signs_of_life(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    heartbeat = Heartbeat(tmp_path, "keeper")
    assert "no keeper" in str(heartbeat.problem())
    heartbeat.beat()
    assert heartbeat.problem() is None
    assert "no worker" in str(Heartbeat(tmp_path, "worker").problem())
    now_s = time.time()
    monkeypatch.setattr(time, "time", lambda: now_s + 3600)
    assert "nothing for 36" in str(heartbeat.problem())
