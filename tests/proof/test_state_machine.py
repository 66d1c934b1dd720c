"""30,000 steps in any order that Hypothesis finds, on SQLite and Postgres: no violation.

And with any one of the protocol's parts taken out, the same machine finds what it was there for.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch
from uuid import UUID

import pytest
from hypothesis import HealthCheck, Phase, seed
from hypothesis import settings as hypothesis_settings
from hypothesis.stateful import run_state_machine_as_test
from sqlalchemy import ColumnElement
from sqlalchemy.orm import Session

from hi5_common.db import errors, migrate, shards, upkeep
from hi5_common.db.engine import Database, open_database
from hi5_common.db.tables import ShardRow
from hi5_common.domain.errors import Hi5Error
from hi5_common.domain.records import StoredObject
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.port import ObjectStore
from services.worker.keeper import Keeper
from tests.proof import fleet as fleet_module
from tests.proof.fleet import Seen
from tests.proof.machine import AnyOrder
from tests.support.faulty import FaultyDatabase
from tests.support.virtual_time import VirtualTime

STEPS = {"sqlite": 25_000, "postgresql": 5_000}
SETTINGS = hypothesis_settings(
    max_examples=50,
    stateful_step_count=100,
    phases=(Phase.generate, Phase.shrink),
    suppress_health_check=list(HealthCheck),
    report_multiple_bugs=False,
)
ONE_FAILURE = hypothesis_settings(
    SETTINGS, max_examples=1000, stateful_step_count=40, phases=(Phase.generate,)
)
MET = {
    *("published", "claim_unheard", "stale_write_refused", "fenced_itself", "landed_late"),
    *("StoreUnavailable", "WrongBytes", "settle_failed", "settle_unknown", "commit_unknown"),
    *("drop", "double", "empty", "extend", "in_use", "revive", "dispatch", "dispatch_failed"),
    *("sweep_leases", "sweep_leases_failed", "sweep_objects", "sweep_objects_failed", "collected"),
}
"""What 25,000 steps are to come across, and 5,000 for the greater part."""


def fleets(database: Database, folder: Path) -> tuple[Callable[[int], type[AnyOrder]], Seen]:
    """Return state machines for seeds, and what they count."""
    clock, seen = VirtualTime(database), Seen()
    faulty = FaultyDatabase(database.engine)

    def seeded(number: int) -> type[AnyOrder]:
        class FleetOnIt(AnyOrder):
            def __init__(self) -> None:
                super().__init__(faulty, clock, folder, seen)

        return seed(number)(FleetOnIt)

    return seeded, seen


@pytest.mark.slow
@pytest.mark.timeout(1800)  # two minutes on a quiet machine; how long it takes proves nothing
def test_exactly_once(database: Database, tmp_path: Path) -> None:
    fleet, seen = fleets(database, tmp_path)
    wanted = STEPS[database.engine.dialect.name]
    rounds, began_s = 0, time.process_time()
    while seen.steps < wanted:
        before = seen.steps
        run_state_machine_as_test(fleet(rounds), settings=SETTINGS)
        rounds += 1
        assert seen.steps > before, "the machine makes no steps"
    spent_s = time.process_time() - began_s
    sys.stdout.write(f"{seen.steps} steps, {rounds} rounds, {spent_s:.0f} s: {dict(seen.met)}\n")
    missed = MET - seen.met.keys() - {what for what, times in seen.met.items() if not times}
    assert len(missed) <= (0 if wanted > 20_000 else len(MET) // 4), missed


def without_guard(shard_id: UUID, attempt: int, owner: str) -> ColumnElement[bool]:
    return ShardRow.id == shard_id


def without_sweep(keeper: Keeper) -> int:
    return 0


def without_verifying(store: ObjectStore, key: str, path: Path, sha256: str) -> StoredObject:
    store.put(key, path, sha256)
    return StoredObject(key, path.stat().st_size, digest(path))


def refused_again(session: Session, *_: object) -> None:
    raise errors.LeaseLost


def too_eager(session: Session, grace_s: float, limit: int = 100) -> list[object]:
    found = sweepable(session, grace_s, limit)
    return [
        upkeep.AttemptsToSweep(f.shard_id, f.dataset_id, f.number, f.first_kept + 1, f.changed_at)
        for f in found
    ]


sweepable = upkeep.attempts_to_sweep


@pytest.mark.parametrize(
    ("where", "name", "instead", "found"),
    [
        (shards, "_held", without_guard, "a zombie was believed"),
        (Keeper, "sweep_leases", without_sweep, "shards were never settled"),
        (fleet_module, "publish", without_verifying, "not"),
        (shards, "_explain_refusal", refused_again, "the holder of a lease was refused"),
        (upkeep, "attempts_to_sweep", too_eager, "no object"),
    ],
)
def test_it_can_fail(
    tmp_path: Path, where: object, name: str, instead: Callable[..., object], found: str
) -> None:
    url = f"sqlite:///{tmp_path / 'hi5.sqlite'}"
    migrate.upgrade(url)
    database = open_database(url)
    fleet, _ = fleets(database, tmp_path)
    with patch.object(where, name, instead), pytest.raises((AssertionError, Hi5Error), match=found):
        run_state_machine_as_test(fleet(0), settings=ONE_FAILURE)
    database.dispose()
