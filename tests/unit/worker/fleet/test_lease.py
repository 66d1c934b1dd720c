"""A lease is given up before it can run out, and at once when it is lost."""

import time
from contextlib import contextmanager
from typing import Any, cast
from uuid import UUID

import pytest

from hi5_common.db import shards
from hi5_common.db.engine import Database
from hi5_common.db.errors import DatabaseUnavailable, LeaseLost
from hi5_common.db.shards import RenewAnswer
from hi5_common.domain.records import Shard, ShardStatus
from hi5_common.settings import Settings
from services.worker.fleet.attempt_errors import CancelRequested, DrainRequested, LeaseGone
from services.worker.fleet.lease import PACKING_S, Lease

SHARD = Shard(UUID(int=1), UUID(int=2), 0, 0, 2, ShardStatus.LEASED, 1, 0, "w", None, None, None)


class _NoDatabase:
    @contextmanager
    def transaction(self) -> Any:
        yield None


def lease(held_since_s: float | None = None) -> Lease:
    settings = Settings(lease_s=1, renew_s=0.02)
    since_s = time.monotonic() if held_since_s is None else held_since_s
    return Lease(cast(Database, _NoDatabase()), SHARD, "w", settings, since_s)


def wait_until_it_raises(held: Lease, error: type[Exception]) -> None:
    with held.held(), pytest.raises(error):
        while True:
            held.check(0)
            time.sleep(0.005)


def test_a_renewed_lease_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    progress: list[int] = []

    def renew(*arguments: Any) -> RenewAnswer:
        progress.append(arguments[-1])
        return RenewAnswer(cancel_requested=False)

    monkeypatch.setattr(shards, "renew", renew)
    held = lease()
    with held.held():
        until_s = time.monotonic() + 1.5  # longer than the lease
        while time.monotonic() < until_s:
            held.check(7)
            time.sleep(0.01)
    assert progress[-1] == 7


def test_without_a_database_the_lease_is_given_up_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    def renew(*_: Any) -> RenewAnswer:
        raise DatabaseUnavailable

    monkeypatch.setattr(shards, "renew", renew)
    since_s = time.monotonic()
    wait_until_it_raises(lease(since_s), LeaseGone)
    assert time.monotonic() - since_s > 0.75  # not at the first failed renewal


def test_a_lost_lease_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    def renew(*_: Any) -> RenewAnswer:
        raise LeaseLost

    monkeypatch.setattr(shards, "renew", renew)
    wait_until_it_raises(lease(), LeaseGone)


def test_a_cancelled_dataset_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shards, "renew", lambda *_: RenewAnswer(cancel_requested=True))
    wait_until_it_raises(lease(), CancelRequested)


def test_time_counts_from_before_the_claim() -> None:
    with pytest.raises(LeaseGone):
        lease(time.monotonic() - 0.8).check(0)


def test_a_worker_told_to_stop_gives_up_what_takes_too_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = 1000.0
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    told: list[bool] = []
    settings = Settings(drain_s=5, lease_s=3600)
    database = cast(Database, _NoDatabase())
    held = Lease(database, SHARD, "w", settings, now_s, draining=lambda: bool(told))
    now_s += 100
    held.check(0)
    told.append(True)
    held.check(0)
    now_s += 5 + PACKING_S
    held.check(0)
    now_s += 0.1
    with pytest.raises(DrainRequested):
        held.check(0)
