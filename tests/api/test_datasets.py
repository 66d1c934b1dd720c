"""Submit, list, cancel, retry, delete: what the rows and the doorbell say afterwards."""

from uuid import UUID

import pytest

from hi5_common.db import shards
from hi5_common.domain.records import ShardStatus
from hi5_common.queue.errors import BrokerUnavailable
from tests.api.world import SPEC, World

YAML_SPEC = "name: test\ncount: 12\nimages_per_shard: 4\nimage: {width: 64, height: 48}\n"


def statuses(world: World, dataset_id: UUID) -> list[ShardStatus]:
    with world.parts.database.snapshot() as session:
        return [shard.status for shard in shards.of_dataset(session, dataset_id, 100)]


def test_submit_stores_shards_and_rings_for_each(world: World) -> None:
    answer = world.client.post("/v1/datasets", json=dict(SPEC))
    assert answer.status_code == 201
    document = answer.json()
    assert answer.headers["location"] == f"/v1/datasets/{document['id']}"
    assert world.client.get(answer.headers["location"]).json() == document
    assert document["status"] == "pending"
    assert document["progress"] == {
        "count": 12,
        "done": 0,
        "in_progress": 0,
        "missing": 0,
        "shards": {"pending": 3, "leased": 0, "done": 0, "failed": 0, "cancelled": 0},
    }
    assert world.rung(3)


def test_yaml_and_json_are_the_same_spec(world: World) -> None:
    by_json = world.client.post("/v1/datasets", json=dict(SPEC)).json()
    headers = {"Content-Type": "application/yaml; charset=utf-8"}
    by_yaml = world.client.post("/v1/datasets", content=YAML_SPEC, headers=headers).json()
    assert by_yaml["spec"] == by_json["spec"]


def test_json_may_be_indented_by_tabs(world: World) -> None:
    headers = {"Content-Type": "application/json"}
    answer = world.client.post("/v1/plans", content='{\n\t"count": 24\n}', headers=headers)
    assert answer.status_code == 200, answer.text


def test_the_same_key_and_spec_give_the_same_dataset(world: World) -> None:
    headers = {"Idempotency-Key": "night run 7"}
    first = world.client.post("/v1/datasets", json=dict(SPEC), headers=headers)
    second = world.client.post("/v1/datasets", json=dict(SPEC), headers=headers)
    assert (first.status_code, second.status_code) == (201, 200)
    assert second.headers["location"] == first.headers["location"]
    assert second.json() == first.json()
    assert len(world.client.get("/v1/datasets").json()["items"]) == 1


def test_the_same_key_with_another_spec_is_refused(world: World) -> None:
    headers = {"Idempotency-Key": "k"}
    world.client.post("/v1/datasets", json=dict(SPEC), headers=headers)
    answer = world.client.post("/v1/datasets", json={**SPEC, "seed": 1}, headers=headers)
    assert answer.status_code == 409
    (problem,) = answer.json()["problems"]
    assert (problem["field"], problem["value"]) == ("Idempotency-Key", "k")
    assert "new key" in problem["remedy"]


def test_a_broker_that_is_away_loses_no_dataset(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    def away(_: object) -> None:
        raise BrokerUnavailable

    monkeypatch.setattr(world.doorbell, "ring", away)
    assert statuses(world, world.submit()) == [ShardStatus.PENDING] * 3


def test_pages_follow_each_other_newest_first(world: World) -> None:
    made = [str(world.submit(name=f"d{number}")) for number in range(5)]
    seen: list[str] = []
    address: str | None = "/v1/datasets?limit=2"
    pages = 0
    while address:
        page = world.client.get(address).json()
        seen += [item["id"] for item in page["items"]]
        address, pages = page["next"], pages + 1
    assert sorted(seen) == sorted(made)
    assert len(set(seen)) == 5
    assert pages == 3


def test_cancel_keeps_what_is_delivered(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    answer = world.client.post(f"/v1/datasets/{dataset_id}/cancel")
    assert answer.status_code == 202
    assert answer.json()["status"] == "cancelled"
    assert statuses(world, dataset_id) == ["done", "cancelled", "cancelled"]
    assert world.client.post(f"/v1/datasets/{dataset_id}/cancel").status_code == 202
    assert world.client.get(f"/v1/datasets/{dataset_id}/images/0").status_code == 200


def test_a_complete_dataset_cannot_be_cancelled(world: World) -> None:
    dataset_id = world.submit(count=4)
    world.deliver()
    answer = world.client.post(f"/v1/datasets/{dataset_id}/cancel")
    assert answer.status_code == 409
    assert answer.json()["problems"][0]["field"] == "status"
    assert answer.json()["problems"][0]["value"] == "complete"


def test_gaps_are_not_retried_and_that_is_said(world: World) -> None:
    dataset_id = world.submit(count=4)
    world.deliver(2)
    answer = world.client.post(f"/v1/datasets/{dataset_id}/retry")
    assert answer.status_code == 409
    assert "gaps, which are not drawn again" in answer.json()["problems"][0]["remedy"]


def test_retry_revives_failed_shards_and_rings(world: World) -> None:
    dataset_id = world.submit()
    assert world.rung(3)
    world.fail("no such pose")
    for _ in range(2):
        world.deliver()
    assert world.client.get(f"/v1/datasets/{dataset_id}").json()["status"] == "failed"
    world.doorbell.messages.clear()
    answer = world.client.post(f"/v1/datasets/{dataset_id}/retry")
    assert answer.status_code == 202
    assert answer.json()["retried_shards"] == 1
    assert answer.json()["dataset"]["status"] == "running"
    assert world.rung(1)
    world.deliver()
    assert world.client.get(f"/v1/datasets/{dataset_id}").json()["status"] == "complete"


def test_a_cancelled_dataset_cannot_be_retried(world: World) -> None:
    dataset_id = world.submit()
    world.client.post(f"/v1/datasets/{dataset_id}/cancel")
    answer = world.client.post(f"/v1/datasets/{dataset_id}/retry")
    assert answer.status_code == 409
    assert answer.json()["problems"][0]["value"] == "cancelled"


def test_a_deleted_dataset_is_gone(world: World) -> None:
    dataset_id, other = world.submit(), world.submit(name="other")
    answer = world.client.delete(f"/v1/datasets/{dataset_id}")
    assert (answer.status_code, answer.content) == (204, b"")
    assert world.client.get(f"/v1/datasets/{dataset_id}").status_code == 404
    assert world.client.delete(f"/v1/datasets/{dataset_id}").status_code == 404
    assert [item["id"] for item in world.client.get("/v1/datasets").json()["items"]] == [str(other)]


def test_events_tell_what_happened_newest_first(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    items = world.client.get(f"/v1/datasets/{dataset_id}/events").json()["items"]
    assert [item["kind"] for item in items] == ["finish", "claim", "create"]
    assert items[0]["shard_number"] == 0
    few = world.client.get(f"/v1/datasets/{dataset_id}/events?limit=1").json()["items"]
    assert few == items[:1]


def test_a_plan_says_what_conditions_come_to(world: World) -> None:
    asked = {
        "count": 120,
        "attributes": {"environment": ["tag:cafe"], "pose": ["fist", "five"]},
        "conditional": [{"given": {"pose": ["fist"]}, "of": "handedness", "shares": ["left"]}],
        "coverage": [{"of": ["pose", "environment"], "at_least": 14}],
        "distributions": {"age": "uniform"},
    }
    answer = world.client.post("/v1/plans", json=asked)
    assert answer.status_code == 200, answer.text
    plan = answer.json()
    (shared,), (covered,) = plan["conditional"], plan["coverage"]
    assert shared["images"] == {"right": 0, "left": 60}
    assert (covered["at_least"], covered["smallest"], covered["largest"]) == (14, 15, 15)
    assert plan["spec"]["distributions"] == {"age": {"uniform": {}}}
    assert len(plan["spec"]["attributes"]["environment"]) == 4
    asked["coverage"] = [{"of": ["pose", "environment"], "at_least": 16}]
    refused = world.client.post("/v1/datasets", json=asked)
    assert refused.status_code == 422
    assert "at_least 15" in refused.text


def test_a_plan_is_shown_and_not_stored(world: World) -> None:
    answer = world.client.post("/v1/plans", json={**SPEC, "attributes": {"gender": {"male": 12}}})
    assert answer.status_code == 200
    plan = answer.json()
    assert (plan["count"], plan["shards"], plan["images_per_shard"]) == (12, 3, 4)
    assert plan["values"]["gender"] == {"male": 12}
    assert sum(plan["values"]["pose"].values()) == 12
    assert plan["joint"] == {"smallest": 0, "largest": 1}
    assert len(plan["first_cells"]) == 12
    assert {cell["gender"] for cell in plan["first_cells"]} == {"male"}
    assert world.client.get("/v1/datasets").json() == {"items": [], "next": None}
