"""What the nemesis's checker says when a part of hi5's protection is switched off.

Each scene is made so that only that part can save it, and is played twice: whole, and broken.
"""

import signal

import pytest

from benchmarks.nemesis.checker import Verdict
from hi5_common.domain.records import ShardStatus
from tests.nemesis.broken import (
    FENCING,
    LEASE_SWEEPER,
    OBJECT_SWEEPER,
    STOPPED_BEFORE_FINISH,
    VERIFY,
)
from tests.nemesis.scene import OBJECTS_OF_A_SHARD, SceneOf
from tests.support.fleet import kill

pytestmark = [pytest.mark.integration, pytest.mark.slow]

CLEAN = Verdict()


@pytest.mark.parametrize("broken", [(), (FENCING,)])
def test_fencing_keeps_a_zombie_from_publishing_again(
    scene_of: SceneOf, broken: tuple[str, ...]
) -> None:
    scene = scene_of(STOPPED_BEFORE_FINISH, *broken)
    zombie, other = scene.fleet.workers
    scene.fleet.keepers[0].start()
    zombie.start()
    stopped = scene.wait_for_stop()
    other.start()
    scene.wait_for_publication()
    assert scene.shard().attempt > 1
    kill(stopped, signal.SIGCONT)
    scene.wait_for_log(zombie, '"action": "published"' if broken else '"action": "lost"')
    if broken:
        assert any("times" in line for line in scene.verdict().twice)
    else:
        scene.wait_for(lambda: scene.objects() == OBJECTS_OF_A_SHARD)
        assert scene.verdict() == CLEAN


@pytest.mark.parametrize("broken", [(), (LEASE_SWEEPER,)])
def test_the_lease_sweeper_has_a_dead_workers_shard_finished(
    scene_of: SceneOf, broken: tuple[str, ...]
) -> None:
    scene = scene_of(STOPPED_BEFORE_FINISH, *broken)
    doomed, other = scene.fleet.workers
    scene.fleet.keepers[0].start()
    doomed.start()
    scene.wait_for_stop()
    doomed.end()
    other.start()
    if broken:
        scene.wait_for(scene.is_overdue)
        assert scene.shard().status is ShardStatus.LEASED
        assert any("is leased" in line for line in scene.verdict().unfinished)
    else:
        scene.wait_for_publication()
        scene.wait_for(lambda: scene.objects() == OBJECTS_OF_A_SHARD)
        assert scene.verdict() == CLEAN


@pytest.mark.parametrize("broken", [(), (OBJECT_SWEEPER,)])
def test_the_object_sweeper_removes_what_a_dead_worker_uploaded(
    scene_of: SceneOf, broken: tuple[str, ...]
) -> None:
    scene = scene_of(STOPPED_BEFORE_FINISH, *broken)
    scene.fleet.keepers[0].start()
    scene.fleet.workers[0].start()
    kill(scene.wait_for_stop())
    scene.wait_for_publication()
    if broken:
        scene.wait_for(scene.is_to_be_swept)
        assert len(scene.verdict().orphans) == OBJECTS_OF_A_SHARD
    else:
        scene.wait_for(lambda: scene.objects() == OBJECTS_OF_A_SHARD)
        assert scene.verdict() == CLEAN


@pytest.mark.parametrize("broken", [(), (VERIFY,)])
def test_the_verify_step_notices_what_a_lying_store_kept(
    scene_of: SceneOf, broken: tuple[str, ...]
) -> None:
    scene = scene_of(*broken)
    scene.servers.lying_store.lies = 1
    scene.fleet.keepers[0].start()
    scene.fleet.workers[0].start()
    scene.wait_for_publication()
    assert scene.servers.lying_store.lies == 0
    if broken:
        assert any("other bytes" in line for line in scene.verdict().wrong)
    else:
        scene.wait_for(lambda: scene.objects() == OBJECTS_OF_A_SHARD)
        assert scene.verdict() == CLEAN
