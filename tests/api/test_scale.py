"""What an answer takes does not grow with the dataset: counted in work, not in time."""

import sqlite3
from dataclasses import dataclass
from uuid import UUID

import pytest
from sqlalchemy import event

from benchmarks.endpoints.filling import deliver
from hi5_common.db import datasets
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from services.api.balance.service import BALANCES_KEPT
from tests.api.world import World

FEW, MANY = 80, 800
"""Shards; a page of the manifest has 50."""


@dataclass
class Work:
    """What SQLite was asked, and the instructions of its virtual machine that answered."""

    statements: int = 0
    instructions: int = 0

    def watch(self, connection: sqlite3.Connection, _record: object) -> None:
        connection.set_progress_handler(self._step, 1)
        connection.set_trace_callback(self._statement)

    def _step(self) -> int:
        self.instructions += 1
        return 0

    def _statement(self, _text: str) -> None:
        self.statements += 1


@pytest.fixture(scope="module")
def pairs(shared_world: World) -> dict[str, tuple[UUID, UUID]]:
    """Return datasets of few and of many shards: delivered, and only submitted."""
    waiting, done = (
        tuple(make(shared_world, size) for size in (FEW, MANY)) for make in (submitted, delivered)
    )
    return {"submitted": (waiting[0], waiting[1]), "delivered": (done[0], done[1])}


@pytest.mark.parametrize("state", ["submitted", "delivered"])
@pytest.mark.parametrize(
    "path",
    [
        "/v1/datasets/{}",
        "/v1/datasets/{}/manifest",
        "/v1/datasets/{}/manifest?after=20",
        "/v1/datasets/{}/balance",
        "/datasets/{}",
        "/datasets/{}?from=100",
    ],
)
def test_ten_times_the_shards_take_no_more_work(
    shared_world: World, pairs: dict[str, tuple[UUID, UUID]], path: str, state: str
) -> None:
    few, many = (asked(shared_world, path.format(dataset_id)) for dataset_id in pairs[state])
    assert few.instructions > 20
    assert many.statements == few.statements
    # Not three hundred instructions more: 720 shards would take thousands even to be counted.
    assert abs(many.instructions - few.instructions) < 300


def submitted(world: World, shards: int) -> UUID:
    with world.parts.database.transaction() as session:
        made = plan(shards)
        return datasets.create(session, made.spec, made).dataset.id


def delivered(world: World, shards: int) -> UUID:
    return deliver(world.parts.database, plan(shards))


def plan(shards: int) -> Plan:
    return Plan.of(parse_spec({"count": 2 * shards, "images_per_shard": 2, "seed": 4}))


def asked(world: World, path: str) -> Work:
    """Count what a request takes, which may be the first for what is kept between requests."""
    world.client.get("/v1/datasets")  # that the key is used is noted by this
    work, engine = Work(), world.parts.database.engine
    engine.dispose()  # connections are watched from their first moment
    event.listen(engine, "connect", work.watch)
    world.client.get(path).raise_for_status()
    event.remove(engine, "connect", work.watch)
    engine.dispose()
    return work


def test_a_balance_needs_no_plan_to_be_made(shared_world: World) -> None:
    dataset_id = delivered(shared_world, 3)
    before = shared_world.parts.plans.made
    balance = shared_world.client.get(f"/v1/datasets/{dataset_id}/balance").json()
    assert balance["worst_delivered_deviation"] == 0
    assert shared_world.parts.plans.made == before


def test_only_some_balances_are_kept(shared_world: World) -> None:
    made = [submitted(shared_world, 3) for _ in range(BALANCES_KEPT + 2)]
    for dataset_id in made:
        shared_world.client.get(f"/v1/datasets/{dataset_id}/balance").raise_for_status()
    kept = shared_world.parts.balances._kept
    assert list(kept) == [(dataset_id, 0) for dataset_id in made[2:]]
