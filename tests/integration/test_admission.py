"""A worker shows that it renders right before it claims its first shard."""

import json

import pytest

from services.worker.fleet.heartbeat import Heartbeat
from tests.support import factories
from tests.support import fleet as support
from tests.support.fleet import Fleet, wait_until

pytestmark = [pytest.mark.integration, pytest.mark.slow]


def canary_on(fleet: Fleet, child: str) -> None:
    changes = {"canary": True, "child_module": child, "idle_poll_s": 1}
    fleet.settings = fleet.settings.model_copy(update=changes)


def test_a_worker_that_draws_nothing_right_claims_nothing_and_says_why(fleet: Fleet) -> None:
    canary_on(fleet, "tests.support.stand_in_child")
    made = factories.dataset(fleet.database)
    fleet.start_keeper()
    fleet.start_worker()
    health = Heartbeat(fleet.settings.health_dir, "worker")
    wait_until(lambda: "its canary failed: " in str(health.problem()), fleet.log)
    said = [path.read_text("utf-8", "replace") for path in fleet.folder.glob("*.log")]
    assert any("this worker claims nothing: its canary failed" in each for each in said)
    assert [shard.attempt for shard in fleet.shards(made.id)] == [0, 0, 0]


@pytest.mark.render
def test_a_worker_whose_canary_passes_works(fleet: Fleet, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(support, "PATIENCE_S", 300.0)  # a new machine compiles its hands first
    canary_on(fleet, "services.worker.render_child")
    made = factories.dataset(fleet.database, attributes={"environment": ["city"]})
    fleet.start_keeper()
    fleet.start_worker()
    wait_until(lambda: "canary passed" in fleet.log(), fleet.log)
    fleet.wait_for_completion(made.id)
    fleet.assert_published_once(made.id)
    ledgers = list(fleet.settings.health_dir.glob("children-*.json"))
    assert {json.loads(each.read_text("utf-8"))["network"] for each in ledgers} == {"none"}
