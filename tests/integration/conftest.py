"""A fleet over real servers, without any process yet."""

import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from hi5_common.db import migrate
from hi5_common.db.engine import open_database
from hi5_common.queue.celery_doorbell import CeleryDoorbell
from hi5_common.storage.open import open_store
from services.worker.keeper import Keeper
from tests.support import runners
from tests.support.fleet import Fleet, running
from tests.support.servers import S3Server

STAND_IN = "tests.support.stand_in_child"


@pytest.fixture
def fleet(
    postgres_url: str, valkey_url: str, s3_server: S3Server, tmp_path: Path
) -> Iterator[Fleet]:
    migrate.upgrade(postgres_url)
    settings = runners.settings(
        tmp_path,
        database_url=postgres_url,
        broker_url=valkey_url,
        child_module=STAND_IN,
        renderer="fake",
        drain_s=0,
        **s3_server.settings(uuid.uuid4().hex),
    )
    database = open_database(postgres_url)
    store = open_store(settings)
    keeper = Keeper(database, store, CeleryDoorbell(settings), settings)
    with running(Fleet(settings, database, store, keeper, tmp_path)) as fleet:
        yield fleet
    database.dispose()
