"""SIGTERM in every moment: what is begun is published or handed back, and nothing is left."""

import signal
import subprocess
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest

from hi5_common.domain import keys
from hi5_common.domain.records import ShardStatus
from tests.support import factories, processes
from tests.support.fleet import Fleet, pollers, wait_until
from tests.support.proxy import TcpProxy, proxy_to
from tests.support.servers import S3Server

pytestmark = [pytest.mark.integration, pytest.mark.slow]

PATIENCE_S = 300
"""Far beyond the 90 s of docker-compose.yml: a busy machine proves no time."""


def stop(fleet: Fleet, worker: "subprocess.Popen[bytes]", times: int = 1) -> None:
    """Send SIGTERM; the worker ends in order, with all its processes and its folder."""
    for _ in range(times):
        worker.send_signal(signal.SIGTERM)
    assert worker.wait(timeout=PATIENCE_S) == 0, fleet.log()
    data_dir = fleet.settings.data_dir

    def alone() -> bool:  # billiard's tracker of semaphores ends a moment later
        found = processes.of_data_dir(data_dir)
        return all("keeper" in each.command for each in found)

    wait_until(alone, fleet.log)
    assert list(data_dir.glob("hi5-drain-*")) == []
    assert list(data_dir.glob("scratch/hi5-attempt-*")) == []


def changed(fleet: Fleet, **changes: object) -> Fleet:
    fleet.settings = fleet.settings.model_validate(fleet.settings.model_dump() | changes)
    return fleet


def test_an_idle_worker_ends_at_once(fleet: Fleet) -> None:
    worker = fleet.start_worker()
    wait_until(lambda: bool(pollers(worker.pid)), fleet.log)
    wait_until(lambda: " ready." in fleet.log(), fleet.log)
    stop(fleet, worker)


def test_a_second_sigterm_changes_nothing(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=60, size=60, name="slow 0.3")
    fleet.start_keeper()
    worker = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    stop(fleet, worker, times=2)
    assert fleet.kinds(made.id) == ["claim", "release"]


def test_a_shard_that_is_nearly_done_is_published(fleet: Fleet) -> None:
    changed(fleet, drain_s=60)
    made = factories.dataset(fleet.database, count=10, size=10, name="slow 0.3")
    fleet.start_keeper()
    worker = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    stop(fleet, worker)
    fleet.assert_published_once(made.id)
    assert fleet.kinds(made.id) == ["claim", "finish"]


def test_the_poller_hands_back_what_it_has(fleet: Fleet) -> None:
    changed(fleet, idle_poll_s=0.5)
    made = factories.dataset(fleet.database, count=60, size=60, name="slow 0.3")
    worker = fleet.start_worker()  # no keeper: no doorbell rings
    fleet.wait_for_progress(made.id)
    stop(fleet, worker)
    assert fleet.kinds(made.id) == ["claim", "release"]
    (shard,) = fleet.shards(made.id)
    assert shard.status is ShardStatus.PENDING


@pytest.fixture
def slow_store(fleet: Fleet, s3_server: S3Server) -> Iterator[TcpProxy]:
    """What stands between the fleet and its store."""
    with proxy_to(int(urlsplit(s3_server.endpoint).port or 0)) as proxy:
        changed(fleet, s3_endpoint=f"http://127.0.0.1:{proxy.port}")
        yield proxy


def test_sigterm_during_an_upload(fleet: Fleet, slow_store: TcpProxy) -> None:
    slow_store.delay_s = 0.3  # each piece: the objects of a shard take seconds
    made = factories.dataset(fleet.database, count=4, size=4)
    fleet.start_keeper()
    worker = fleet.start_worker()
    prefix = keys.dataset_prefix(made.id)

    def uploading() -> bool:
        return bool(list(fleet.store.list(prefix)))

    wait_until(uploading, fleet.log)
    stop(fleet, worker)
    kinds = fleet.kinds(made.id)
    assert kinds in (["claim", "finish"], ["claim", "release"])
    slow_store.heal()
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)


def test_a_worker_whose_main_process_is_killed_leaves_no_folder(fleet: Fleet) -> None:
    worker = fleet.start_worker()
    wait_until(lambda: bool(pollers(worker.pid)), fleet.log)
    wait_until(lambda: " ready." in fleet.log(), fleet.log)
    worker.kill()
    wait_until(lambda: processes.of_data_dir(fleet.settings.data_dir) == [], fleet.log)
    assert list(fleet.settings.data_dir.glob("hi5-drain-*")) == []
