"""Real workers and a real keeper over Postgres, Valkey and SeaweedFS.

Whatever is killed, every image is published exactly once.
"""

import signal
import time

import pytest

from hi5_common.domain.records import ShardStatus
from tests.support import factories
from tests.support.fleet import (
    Fleet,
    command_line,
    descendants,
    kill,
    pool_processes,
    render_children,
    wait_until,
)
from tests.support.servers import empty_broker

pytestmark = [pytest.mark.integration, pytest.mark.slow]


def test_a_dataset_is_completed(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=20, size=4)
    fleet.start_keeper()
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert fleet.kinds(made.id).count("claim") == 5


def test_the_real_render_child(fleet: Fleet) -> None:
    changes = {"child_module": "services.worker.render_child"}
    fleet.settings = fleet.settings.model_copy(update=changes)
    made = factories.dataset(fleet.database, count=2, size=2)
    fleet.start_keeper()
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)


def test_kill_9_of_the_render_child(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=8, size=8, name="slow 0.3")
    fleet.start_keeper()
    worker = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    for pid in render_children(worker.pid, fleet.settings):
        kill(pid)
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert fleet.kinds(made.id) == ["claim", "finish"]  # only the image in flight was lost


def test_kill_9_of_the_whole_worker(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=12, size=6, name="slow 0.3")
    fleet.start_keeper()
    worker = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    for pid in (worker.pid, *pool_processes(worker.pid, fleet.settings)):
        kill(pid)
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert "expire" in fleet.kinds(made.id)


def test_kill_9_of_the_supervising_process(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=12, size=6, name="slow 0.3")
    fleet.start_keeper()
    worker = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    children = render_children(worker.pid, fleet.settings)
    for pid in pool_processes(worker.pid, fleet.settings):
        kill(pid)
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert not set(children) & set(render_children(worker.pid, fleet.settings))


def test_kill_9_of_the_main_process_leaves_nobody_behind(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=12, size=12, name="slow 0.3")
    fleet.start_keeper()
    worker = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    below = descendants(worker.pid)
    worker.kill()
    wait_until(lambda: not any(command_line(pid) for pid in below), fleet.log)
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)


def test_a_worker_that_slept_too_long_is_fenced_off(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=6, size=6, name="slow 0.3")
    fleet.start_keeper()
    sleeper = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    stopped = [*pool_processes(sleeper.pid, fleet.settings)]
    for pid in stopped:
        kill(pid, signal.SIGSTOP)
    fleet.start_worker()
    fleet.wait_for_completion(made.id)
    (published,) = fleet.shards(made.id)
    for pid in stopped:
        kill(pid, signal.SIGCONT)
    wait_until(lambda: "action=lost" in fleet.log(), fleet.log)
    assert fleet.shards(made.id) == [published]
    fleet.assert_published_once(made.id)


def test_a_broker_that_forgets_everything(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=24, size=2, name="slow 0.1")
    fleet.start_keeper()
    fleet.start_worker()
    for _ in range(10):
        empty_broker(fleet.settings.broker_url)
        time.sleep(0.3)
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)


def test_every_message_twice(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=12, size=2, name="slow 0.1")
    shard_ids = [shard.id for shard in fleet.shards(made.id)]
    fleet.keeper.doorbell.ring([*shard_ids, *shard_ids])
    assert fleet.keeper.doorbell.waiting() == 12
    for _ in range(2):
        fleet.start_worker()
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    assert fleet.kinds(made.id).count("claim") == 6


def test_sigterm_hands_the_shard_back(fleet: Fleet) -> None:
    made = factories.dataset(fleet.database, count=60, size=60, name="slow 0.3")
    fleet.start_keeper()
    worker = fleet.start_worker()
    fleet.wait_for_progress(made.id)
    worker.send_signal(signal.SIGTERM)
    assert worker.wait(timeout=60) == 0, fleet.log()
    (shard,) = fleet.shards(made.id)
    assert shard.status is ShardStatus.PENDING
    assert fleet.kinds(made.id) == ["claim", "release"]
