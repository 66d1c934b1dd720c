"""2,000 seeds of a fleet in which everything fails: nothing lost, nothing double, nothing left.

And with any one of the protocol's parts taken out, some of the first seeds find it.
More seeds: `python -m tests.proof.simulation --seeds N --first S`; one of them: `--seed S`.
"""

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch
from uuid import UUID

import pytest
from sqlalchemy import ColumnElement

from hi5_common.db import shards
from hi5_common.db.tables import ShardRow
from hi5_common.domain.records import StoredObject
from hi5_common.storage.port import Heed, ObjectStore
from services.worker.fleet import shard_runner
from services.worker.keeper import Keeper
from tests.proof.simulation import Simulation, tables_in_memory

SEEDS = 2000
ENOUGH = 300
"""Among so many seeds a missing part of the protocol shows."""
POINTS = {
    *("database.before", "snapshot.before", "claim.commit", "claim.committed", "renew.commit"),
    *("renew.committed", "render.start", "render.image", "render.gap", "render.end", "put.before"),
    *("put.after", "verify.before", "verify.after", "finish.commit", "finish.committed"),
    *("fail.commit", "fail.committed", "release.commit", "drain", "deliver", "message"),
    *("waiting.before", "pending_to_ring.commit", "pending_to_ring.committed", "ring.before"),
    *("ring.after", "sweep_expired.commit", "sweep_expired.committed", "list.before", "list.after"),
    *("delete.before", "delete.after", "mark_swept.commit", "mark_swept.committed"),
}
"""Where processes are struck: each of them must be, in 2,000 seeds."""


def violations(tmp_path: Path, seeds: range) -> tuple[dict[int, object], Counter[str]]:
    """Return what each seed found that found something, and which faults there were."""
    found: dict[int, object] = {}
    struck: Counter[str] = Counter()
    with tables_in_memory() as tables:
        for seed in seeds:
            simulation = Simulation(seed, tables, tmp_path)
            wrong = simulation.run().violations()
            struck += simulation.points.struck
            if wrong:
                found[seed] = wrong
                break
    return found, struck


@pytest.mark.slow
@pytest.mark.timeout(1800)  # two minutes on a quiet machine; how long it takes proves nothing
def test_nothing_is_lost_or_doubled(tmp_path: Path) -> None:
    found, struck = violations(tmp_path, range(SEEDS))
    assert not found, f"replay with: python -m tests.proof.simulation --seed {min(found)}: {found}"
    sys.stdout.write(f"{SEEDS} seeds, {struck.total()} faults of {len(struck)} kinds\n")
    assert {what.partition(":")[0] for what in struck} >= POINTS


def test_the_same_seed_is_the_same_run(tmp_path: Path) -> None:
    with tables_in_memory() as tables:
        runs = []
        for _ in range(2):
            runs.append(Simulation(7, tables, tmp_path))
            runs[-1].run()
    first, second = ([line.split()[:3] for line in run.points.trace] for run in runs)
    assert len(first) > 20
    assert first == second  # when who did what; ids are drawn by the system


def no_guard(shard_id: UUID, attempt: int, owner: str) -> ColumnElement[bool]:
    return ShardRow.id == shard_id


def no_sweep(keeper: Keeper) -> int:
    return 0


def no_verifying(store: ObjectStore, key: str, path: Path, sha256: str, heed: Heed) -> StoredObject:
    store.put(key, path, sha256, heed)
    return StoredObject(key, path.stat().st_size, sha256)


@pytest.mark.parametrize(
    ("where", "name", "instead", "kinds"),
    [
        (shards, "_held", no_guard, {"duplicated", "unexpected", "lost", "errors"}),
        (Keeper, "sweep_leases", no_sweep, {"unfinished"}),
        (Keeper, "sweep_objects", no_sweep, {"orphans"}),
        (shard_runner, "publish", no_verifying, {"lost"}),
    ],
)
def test_it_can_fail(
    tmp_path: Path, where: object, name: str, instead: Callable[..., object], kinds: set[str]
) -> None:
    with patch.object(where, name, instead):
        found, _ = violations(tmp_path, range(ENOUGH))
    assert found, f"{ENOUGH} seeds and nobody noticed"
    (wrong,) = found.values()
    assert isinstance(wrong, dict)
    assert wrong.keys() & kinds, wrong
