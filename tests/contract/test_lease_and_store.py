"""An upload that takes its time: as long as the lease is held, and no longer."""

import threading
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from hi5_common.db import datasets, migrate, shards
from hi5_common.db.engine import Database, open_database
from hi5_common.domain.records import ShardStatus
from hi5_common.settings import Settings
from hi5_common.storage import errors
from hi5_common.storage.obstore_store import PART_BYTES, digest
from hi5_common.storage.open import open_store
from hi5_common.storage.publish import publish
from hi5_common.storage.s3 import Patience
from services.worker.fleet.shard_runner import Outcome
from tests.support import factories, runners
from tests.support.faulty_s3 import Fault, FaultyS3, Kind, faulty_proxy
from tests.support.proxy import proxy_to
from tests.support.servers import S3Server

GENEROUS_S = 600.0


class Abandoned(Exception):
    """What a heed raises in these tests."""


class Heeding:
    """A heed that has enough at its `last`-th call."""

    def __init__(self, last: int) -> None:
        self.calls = 0
        self.last = last

    def __call__(self) -> None:
        self.calls += 1
        if self.calls >= self.last:
            raise Abandoned


def settings_through(server: S3Server, port: int) -> Settings:
    changes = {"s3_endpoint": f"http://127.0.0.1:{port}"}
    return Settings.model_validate(server.settings(uuid.uuid4().hex) | changes)


@pytest.fixture
def faulty(s3_server: S3Server) -> Iterator[FaultyS3]:
    with faulty_proxy(s3_server) as proxy:
        yield proxy


@pytest.fixture
def sqlite(tmp_path: Path) -> Iterator[Database]:
    url = f"sqlite:///{tmp_path / 'hi5.sqlite'}"
    migrate.upgrade(url)
    database = open_database(url)
    yield database
    database.dispose()


@pytest.mark.parametrize("lease_s", [1.0, 4.0, 60.0, 600.0])
def test_a_request_ends_before_its_lease_can(lease_s: float) -> None:
    settings = Settings(lease_s=lease_s, renew_s=lease_s / 4)
    held_s = settings.lease_s - settings.fence_margin_s
    patience = Patience.within(held_s)
    assert patience.longest_s < held_s
    assert patience.request_s < patience.retry_s  # what was never answered is asked again


@pytest.mark.integration
def test_a_frozen_store_is_given_up(s3_server: S3Server, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"bytes")
    with proxy_to(int(s3_server.endpoint.rpartition(":")[2])) as proxy:
        settings = settings_through(s3_server, proxy.port)
        store = open_store(settings, patience_s=1)
        proxy.frozen = True
        with pytest.raises(errors.StoreUnavailable):
            publish(store, "o/a", path, digest(path))


@pytest.mark.integration
def test_a_frozen_upload_is_abandoned_when_told(s3_server: S3Server) -> None:
    with proxy_to(int(s3_server.endpoint.rpartition(":")[2])) as proxy:
        store = open_store(settings_through(s3_server, proxy.port), GENEROUS_S)
        proxy.frozen = True
        heeding = Heeding(3)
        with pytest.raises(Abandoned):
            store.put("o/a", b"bytes", digest(b"bytes"), heeding)
        assert heeding.calls == 3


@pytest.mark.integration
@pytest.mark.parametrize("size_bytes", [100_000, PART_BYTES + 100_000], ids=["one", "parts"])
def test_an_abandoned_upload_stores_nothing(faulty: FaultyS3, size_bytes: int) -> None:
    settings = settings_through(faulty.server, faulty.port)
    data = b"x" * size_bytes
    faulty.always[Kind.PUT] = Fault.SLOW
    with pytest.raises(Abandoned):
        open_store(settings, GENEROUS_S).put("o/a", data, digest(data), Heeding(2))
    faulty.heal()
    with pytest.raises(errors.ObjectMissing):
        open_store(settings, GENEROUS_S).head("o/a")


@pytest.mark.integration
def test_a_slow_link_carries_what_takes_longer_than_a_request_may(
    s3_server: S3Server, tmp_path: Path
) -> None:
    path = tmp_path / "large"
    path.write_bytes(b"hi5!" * (4 << 20))
    rate, patience_s = 4e6, 6.0
    assert path.stat().st_size / rate > 1.5 * Patience.within(patience_s).request_s
    with proxy_to(int(s3_server.endpoint.rpartition(":")[2])) as proxy:
        store = open_store(settings_through(s3_server, proxy.port), patience_s)
        proxy.bytes_per_s = rate
        heeding = Heeding(10**9)
        stored = publish(store, "o/a", path, digest(path), heeding)
    assert stored.size_bytes == path.stat().st_size
    assert heeding.calls > 10


@pytest.mark.integration
def test_an_attempt_whose_lease_is_lost_stops_uploading(
    faulty: FaultyS3, sqlite: Database, tmp_path: Path
) -> None:
    made = factories.dataset(sqlite, count=1, size=1)
    store = open_store(settings_through(faulty.server, faulty.port), GENEROUS_S)
    faulty.bytes_per_s = 20.0
    faulty.always[Kind.PUT] = Fault.SLOW
    outcomes: list[Outcome | None] = []
    slot = runners.runner(sqlite, store, tmp_path)
    thread = threading.Thread(target=lambda: outcomes.append(slot.run_next(None)))
    thread.start()
    while not any(seen.kind is Kind.PUT for seen in faulty.seen):
        thread.join(0.05)
        assert thread.is_alive()
    with sqlite.transaction() as session:
        (shard,) = shards.of_dataset(session, made.id, 10)
        shards.release(session, shard.id, shard.attempt, "w")
    thread.join(120)
    assert outcomes == [Outcome.LOST]
    with sqlite.snapshot() as session:
        (left,) = shards.of_dataset(session, made.id, 10)
        assert datasets.get(session, made.id).images_done == 0
    assert left.status is ShardStatus.PENDING
