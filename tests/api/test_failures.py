"""What failed, over HTTP and on the pages; and the machines it failed on."""

from hi5_common.db import shards, workers
from hi5_common.domain.plan import Plan
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.spec import parse_spec
from tests.api.test_dashboard import page
from tests.api.world import World


def fail(world: World, reason: str, index: int | None) -> None:
    shard = world.claim()
    with world.parts.database.transaction() as session:
        shards.fail(
            session, shard.id, shard.attempt, "test-worker", FailureKind.IMAGE, reason, index
        )


def test_failures_come_with_the_scene_newest_first(world: World) -> None:
    dataset_id = world.submit(seed=7)
    address = f"/v1/datasets/{dataset_id}/failures"
    assert world.client.get(address).json() == {"items": [], "next": None}
    fail(world, "no GPU; log: driver too old", None)
    fail(world, "image 5 crashed", 5)
    newest, oldest = world.client.get(address).json()["items"]
    scene = newest["scene"]
    assert (scene["seed"], scene["index"], scene["draw"]) == (7, 5, 0)
    spec = world.client.get(f"/v1/datasets/{dataset_id}").json()["spec"]
    assert scene["attributes"] == Plan.of(parse_spec(spec)).cell(5).as_dict()
    assert scene["command"].startswith(f"hi5 render {dataset_id}.json --index 5 --draw 0 ")
    assert oldest["scene"] is None
    assert (oldest["failure"]["reason"], oldest["failure"]["log"]) == (
        "no GPU",
        "driver too old",
    )
    assert newest["failure"]["owner"] == "test-worker"


def test_failures_are_paged(world: World) -> None:
    dataset_id = world.submit()
    for number in range(3):
        fail(world, str(number), None)
    seen, address = [], f"/v1/datasets/{dataset_id}/failures?limit=2"
    while address:
        found = world.client.get(address).json()
        seen += [item["failure"]["reason"] for item in found["items"]]
        address = found["next"]
    assert seen == ["2", "1", "0"]


def test_gaps_and_redraws_of_published_shards_are_there(world: World) -> None:
    dataset_id = world.submit()
    world.deliver(2)
    (item,) = world.client.get(f"/v1/datasets/{dataset_id}/failures").json()["items"]
    assert (item["failure"]["of"], item["scene"]["index"]) == ("gap", 2)


def test_failures_of_no_dataset_are_not_found(world: World) -> None:
    answer = world.client.get(f"/v1/datasets/{'0' * 32}/failures")
    assert answer.status_code == 404
    assert answer.json()["problems"][0]["field"] == "dataset_id"


def test_the_page_shows_what_failed_escaped(world: World) -> None:
    dataset_id = world.submit()
    assert "What failed last" not in page(world, dataset_id)
    fail(world, "<b>broken</b>; log: <i>trace</i>", 1)
    html = page(world, dataset_id)
    assert "What failed last" in html
    assert "--index 1 --draw 0" in html
    assert "<i>trace" not in html
    assert "&lt;i&gt;trace" in html


def block(world: World, name: str) -> None:
    world.submit(count=20)
    with world.parts.database.transaction() as session:
        workers.seen(session, name, 1)
        for _ in range(3):
            shard = shards.claim(session, None, "w", 60)
            assert shard
            workers.failed(session, name, shard.id, FailureKind.WORKER, "no <GPU>", 600)


def test_a_blocked_machine_is_shown_and_unblocked(world: World) -> None:
    block(world, "node-1")
    (shown,) = world.client.get("/v1/workers").json()["items"]
    assert (shown["name"], shown["alive"], shown["failed_shards"]) == ("node-1", True, 3)
    assert shown["blocked_until"]
    assert "no <GPU>" in shown["blocked_reason"]
    html = world.client.get("/").text
    assert "no &lt;GPU&gt;" in html
    answer = world.client.post("/v1/workers/node-1/unblock")
    assert answer.status_code == 200, answer.text
    assert answer.json()["blocked_until"] is None
    (shown,) = world.client.get("/v1/workers").json()["items"]
    assert (shown["failed_shards"], shown["blocked_reason"]) == (0, None)


def test_an_unknown_machine_is_not_found(world: World) -> None:
    answer = world.client.post("/v1/workers/nobody/unblock")
    assert answer.status_code == 404
    assert answer.json()["problems"][0]["value"] == "nobody"
