"""Migrations lead forward and back, and to the very tables the code believes in."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import inspect, text

from benchmarks.endpoints.filling import GAP_EVERY, deliver
from hi5_common.db import datasets, deliveries, errors, migrate, planned, quotas, shards
from hi5_common.db.engine import make_write_ahead, open_database
from hi5_common.db.quotas import LOCAL_HOLDING, Holding
from hi5_common.db.tables import Base, ShardRow
from hi5_common.domain.cost import Cost
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Tallies
from hi5_common.domain.tallies import tally
from tests.support import factories


def test_tables_are_what_the_models_say(database_url: str) -> None:
    migrate.upgrade(database_url)
    database = open_database(database_url)
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []
        checks = {
            (table, str(check["name"]))
            for table in Base.metadata.tables
            for check in inspect(connection).get_check_constraints(table)
        }
    database.dispose()
    assert checks >= {
        (table.name, str(constraint.name))
        for table in Base.metadata.tables.values()
        for constraint in table.constraints
        if str(constraint.name).startswith("ck_")
    }


def test_forward_back_and_forward_again(database_url: str) -> None:
    assert migrate.current(database_url) is None
    migrate.upgrade(database_url)
    assert migrate.current(database_url) == migrate.head()
    migrate.downgrade(database_url, "base")
    database = open_database(database_url)
    with database.engine.connect() as connection:
        assert inspect(connection).get_table_names() == ["alembic_version"]
    database.dispose()
    migrate.upgrade(database_url)
    assert migrate.current(database_url) == migrate.head()


def test_a_database_with_published_shards_is_summed_up(database_url: str) -> None:
    migrate.upgrade(database_url)
    database = open_database(database_url)
    made, untouched = (factories.dataset(database, seed=seed) for seed in (1, 2))
    with database.transaction() as session:
        for missing in ((), (2,)):
            claimed = shards.claim(session, None, "w", 60)
            assert claimed
            published = factories.publication(claimed, missing=missing)
            shards.finish(session, claimed.id, claimed.attempt, "w", published)
        before = datasets.page(session, 10)
    assert sum(each.images_missing for each in before) == 1
    migrate.downgrade(database_url, "0001")
    migrate.upgrade(database_url)
    with database.snapshot() as session:
        assert datasets.page(session, 10) == before
        delivered = [deliveries.tallies(session, each.id).values for each in (made, untouched)]
    database.dispose()
    assert sorted(delivered, key=len) == [{}, {"gender=male": 3}]


def test_plans_of_datasets_there_are_are_added_up(database_url: str) -> None:
    migrate.upgrade(database_url)
    database = open_database(database_url)
    plan = Plan.of(factories.spec(count=30, size=7, attributes={"ring": ["none", "gem"]}))
    with database.transaction() as session:
        made = datasets.create(session, plan.spec, plan).dataset
    migrate.downgrade(database_url, "0002")
    migrate.upgrade(database_url)
    with database.snapshot() as session:
        assert planned.tallies(session, made.id) == plan.tallies()
        assert datasets.page(session, 10) == [made]
    database.dispose()


def test_pairs_leave_the_shards_for_the_sum_and_come_back(database_url: str) -> None:
    migrate.upgrade(database_url)
    database = open_database(database_url)
    plan = Plan.of(factories.spec(count=GAP_EVERY * 2, size=2))
    dataset_id = deliver(database, plan)

    def pairs() -> list[dict[str, int]]:
        with database.snapshot() as session:
            found = session.query(ShardRow).filter_by(dataset_id=dataset_id).order_by("number")
            return [row.publication["tallies"]["pairs"] for row in found if row.publication]

    def delivered() -> Tallies:
        with database.snapshot() as session:
            return deliveries.tallies(session, dataset_id)

    before = delivered()
    assert pairs() == [{}] * GAP_EVERY
    migrate.downgrade(database_url, "0003")
    cells = [plan.cell(index).as_dict() for index in range(plan.count)]
    first, *_, last = pairs()
    assert first == tally(cells[:2], plan.crossed).pairs
    assert last == tally(cells[-1:], plan.crossed).pairs  # the last shard has a gap
    migrate.downgrade(database_url, "0001")  # where nothing but the shards has them
    migrate.upgrade(database_url)
    assert delivered() == before
    assert pairs() == [{}] * GAP_EVERY
    database.dispose()


def test_what_is_there_gets_an_owner_and_keeps_its_idempotency_key(database_url: str) -> None:
    migrate.upgrade(database_url)
    database = open_database(database_url)
    spec, cut = factories.spec(), factories.Cut(6, 2)
    with database.transaction() as session:
        for holding in (LOCAL_HOLDING, Holding("lab")):
            datasets.create(session, spec, cut, holding=holding, idempotency_key="monday")
    migrate.downgrade(database_url, "0007")
    with database.engine.connect() as connection:
        stored = connection.execute(text("SELECT idempotency_key FROM dataset")).scalars().all()
    assert sorted(stored, key=str) == [None, "monday"]
    migrate.upgrade(database_url)
    with database.transaction() as session:
        assert len(datasets.page(session, 10, owner="local")) == 2
        assert quotas.used(session, "local") == Cost(12, 12 * 64 * 48, 3 * 12 * 64 * 48)
        assert not datasets.create(session, spec, cut, idempotency_key="monday").created
    database.dispose()


def test_several_processes_may_upgrade_at_once(database_url: str) -> None:
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(migrate.upgrade, [database_url] * 4))
    assert migrate.current(database_url) == migrate.head()


def test_many_may_make_a_new_file_write_ahead_at_once(tmp_path: Path) -> None:
    for number in range(20):
        url = f"sqlite:///{tmp_path / str(number)}.sqlite"
        together = Barrier(6)

        def switch(url: str = url, together: Barrier = together) -> str:
            database = open_database(url)
            together.wait()
            make_write_ahead(database.engine)
            with database.engine.connect() as connection:
                mode = str(connection.exec_driver_sql("PRAGMA journal_mode").scalar())
            database.dispose()
            return mode

        with ThreadPoolExecutor(6) as pool:
            modes = [job.result() for job in [pool.submit(switch) for _ in range(6)]]
        assert modes == ["wal"] * 6


def test_a_database_without_tables_says_what_to_do(database_url: str) -> None:
    database = open_database(database_url)
    with pytest.raises(errors.DatabaseOutdated, match="migrate"), database.snapshot() as session:
        datasets.page(session, 1)
    database.dispose()


def test_a_database_of_a_newer_version_says_what_to_do(database_url: str) -> None:
    migrate.upgrade(database_url)
    database = open_database(database_url)
    with database.engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    database.dispose()
    with pytest.raises(errors.UnknownRevision, match="made by a newer one"):
        migrate.upgrade(database_url)
