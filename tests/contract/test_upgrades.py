"""Migrations with jobs in flight: leases stay, and workers carry on through them."""

import threading
from dataclasses import replace
from pathlib import Path

from hi5_common.db import datasets, events, migrate, shards
from hi5_common.db.engine import Database
from hi5_common.domain.records import DatasetStatus, ShardStatus
from services.worker.fleet.shard_runner import Outcome
from tests.contract.test_shard_runner import Store
from tests.support import factories
from tests.support.runners import runner

BEFORE = "0007"


def test_leases_outlive_a_downgrade_and_an_upgrade(database: Database, database_url: str) -> None:
    made = factories.dataset(database, count=6, size=2)
    with database.transaction() as session:
        held = shards.claim(session, None, "w", 600)
        other = shards.claim(session, None, "v", 600)
        assert held
        assert other
        before = shards.of_dataset(session, made.id, 10)
    migrate.downgrade(database_url, BEFORE)
    with database.transaction() as session:
        assert shards.of_dataset(session, made.id, 10) == before
        shards.renew(session, held.id, held.attempt, "w", 600, 1)
        shards.release(session, other.id, other.attempt, "v")
    migrate.upgrade(database_url)
    with database.transaction() as session:
        shards.finish(session, held.id, held.attempt, "w", factories.publication(held))
        again = shards.claim(session, other.id, "u", 600)
        states = [shard.status for shard in shards.of_dataset(session, made.id, 10)]
    assert again
    assert (again.number, again.attempt) == (other.number, 2)
    assert states == [ShardStatus.DONE, ShardStatus.LEASED, ShardStatus.PENDING]


def test_a_worker_carries_on_through_a_migration(
    database: Database, database_url: str, tmp_path: Path
) -> None:
    """Its publication waits while the tables are those of another version."""
    made = factories.dataset(database, count=4, size=4)
    store = Store(before_put=threading.Event())
    slot = runner(database, store, tmp_path)
    patient = replace(slot, settings=slot.settings.model_copy(update={"lease_s": 120.0}))
    outcomes: list[Outcome | None] = []
    working = threading.Thread(target=lambda: outcomes.append(patient.run_next(None)))
    working.start()
    assert store.put_begins.wait(60)
    migrate.downgrade(database_url, BEFORE)
    assert store.before_put
    store.before_put.set()
    working.join(3)
    assert outcomes == []
    migrate.upgrade(database_url)
    working.join()
    assert outcomes == [Outcome.PUBLISHED]
    with database.snapshot() as session:
        assert datasets.get(session, made.id).status is DatasetStatus.COMPLETE
        kinds = [event.kind for event in events.of_dataset(session, made.id, 10)]
    assert kinds == ["create", "claim", "finish"]
