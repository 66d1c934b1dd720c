"""What a dataset delivers: manifest, balance, images, labels, objects."""

import hashlib
import io
import tarfile
from typing import Any
from uuid import UUID

import httpx
import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from tests.api.world import SPEC, World, label_of, picture


def problem(answer: httpx.Response) -> dict[str, Any]:
    assert answer.headers["content-type"] == "application/problem+json"
    (found,) = answer.json()["problems"]
    assert isinstance(found, dict)
    return found


def object_address(dataset_id: UUID, number: int, name: str = "samples.tar") -> str:
    return f"/v1/datasets/{dataset_id}/shards/{number}/objects/{name}"


def test_the_manifest_names_every_object_by_its_hash(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    manifest = world.client.get(f"/v1/datasets/{dataset_id}/manifest").json()
    assert manifest["status"] == "running"
    assert manifest["progress"]["done"] == 4
    done, *waiting = manifest["shards"]
    assert [shard["status"] for shard in waiting] == ["pending", "pending"]
    assert [shard["objects"] for shard in waiting] == [[], []]
    assert (done["number"], done["start"], done["stop"], done["attempt"]) == (0, 0, 4, 1)
    for item in done["objects"]:
        stored = world.store.get(item["key"])
        assert hashlib.sha256(stored).hexdigest() == item["sha256"]
        assert len(stored) == item["size_bytes"]
    assert sum(n for key, n in done["tallies"].items() if key.startswith("gender=")) == 4
    assert manifest["tallies"] == done["tallies"]


def test_the_manifest_is_paged_by_shard_number(world: World) -> None:
    dataset_id = world.submit(count=10, images_per_shard=2)
    first = world.client.get(f"/v1/datasets/{dataset_id}/manifest?limit=3").json()
    second = world.client.get(first["next"]).json()
    assert [shard["number"] for shard in first["shards"]] == [0, 1, 2]
    assert [shard["number"] for shard in second["shards"]] == [3, 4]
    assert second["next"] is None


def test_the_manifest_says_why_a_shard_failed(world: World) -> None:
    dataset_id = world.submit()
    world.fail("image 2 never passed its checks")
    shard = world.client.get(f"/v1/datasets/{dataset_id}/manifest").json()["shards"][0]
    assert shard["status"] == "failed"
    assert "image 2 never passed its checks" in shard["failure_reason"]


def test_balance_of_a_complete_dataset_is_the_plan(world: World) -> None:
    dataset_id = world.submit(attributes={"gender": {"male": 9, "female": 3}})
    for _ in range(3):
        world.deliver()
    balance = world.client.get(f"/v1/datasets/{dataset_id}/balance").json()
    assert (balance["count"], balance["delivered"]) == (12, 12)
    gender = balance["attributes"][0]
    assert gender["attributes"] == ["gender"]
    assert gender["cells"] == [
        {"values": ["female"], "requested": 3.0, "planned": 3, "delivered": 3},
        {"values": ["male"], "requested": 9.0, "planned": 9, "delivered": 9},
    ]
    assert len(balance["pairs"]) == 15
    for table in balance["attributes"] + balance["pairs"]:
        assert sum(cell["delivered"] for cell in table["cells"]) == 12
    assert balance["worst_delivered_deviation"] == 0


def test_balance_follows_each_delivered_shard(world: World) -> None:
    dataset_id = world.submit()
    for delivered in (0, 4, 8):
        balance = world.client.get(f"/v1/datasets/{dataset_id}/balance").json()
        assert balance["delivered"] == delivered
        for table in balance["attributes"]:
            assert sum(cell["delivered"] for cell in table["cells"]) == delivered
        world.deliver()


@pytest.mark.parametrize("index", [0, 3])
def test_an_image_and_its_label_come_out_byte_for_byte(world: World, index: int) -> None:
    dataset_id = world.submit()
    world.deliver()
    image = world.client.get(f"/v1/datasets/{dataset_id}/images/{index}")
    assert image.status_code == 200
    assert image.headers["content-type"] == "image/jpeg"
    assert image.content == picture(index)
    assert image.headers["etag"] == f'"{hashlib.sha256(picture(index)).hexdigest()}"'
    assert "immutable" in image.headers["cache-control"]
    label = world.client.get(f"/v1/datasets/{dataset_id}/images/{index}/labels")
    assert label.headers["content-type"] == "application/json"
    plan = Plan.of(parse_spec(dict(SPEC)))
    assert label.content == label_of(plan, index).model_dump_json().encode()


def test_a_known_image_is_not_sent_again(world: World) -> None:
    address = f"/v1/datasets/{world.submit()}/images/1"
    world.deliver()
    etag = world.client.get(address).headers["etag"]
    answer = world.client.get(address, headers={"If-None-Match": f'"other", W/{etag}'})
    assert (answer.status_code, answer.content) == (304, b"")
    assert answer.headers["etag"] == etag
    changed = world.client.get(address, headers={"If-None-Match": '"other"'})
    assert changed.status_code == 200


@pytest.mark.parametrize("part", ["images/5", "images/5/labels", "shards/1/objects/samples.tar"])
def test_what_is_not_delivered_says_which_shard_and_how_far(world: World, part: str) -> None:
    dataset_id = world.submit()
    world.deliver()
    answer = world.client.get(f"/v1/datasets/{dataset_id}/{part}")
    assert answer.status_code == 404
    found = problem(answer)
    assert found["field"] in {"index", "number"}
    assert found["value"] in {5, 1}
    assert "Shard 1 is pending" in found["remedy"]
    world.fail("it broke")
    failed = problem(world.client.get(f"/v1/datasets/{dataset_id}/{part}"))
    assert "it broke" in failed["remedy"]
    assert "/retry" in failed["remedy"]


@pytest.mark.parametrize("part", ["images/2", "images/2/labels"])
def test_a_gap_says_why_it_is_missing_and_the_manifest_names_it(world: World, part: str) -> None:
    dataset_id = world.submit(count=4)
    world.deliver(2)
    answer = world.client.get(f"/v1/datasets/{dataset_id}/{part}")
    assert answer.status_code == 404
    assert "<it broke>" in answer.json()["detail"]
    assert problem(answer)["value"] == 2
    manifest = world.client.get(f"/v1/datasets/{dataset_id}/manifest").json()
    assert manifest["status"] == "complete_with_gaps"
    assert (manifest["progress"]["done"], manifest["progress"]["missing"]) == (3, 1)
    gap = {"index": 2, "reason": "failed 5 times: <it broke>"}
    assert manifest["shards"][0]["gaps"] == [gap]
    assert world.client.post(f"/v1/datasets/{dataset_id}/cancel").status_code == 409


def test_an_index_outside_the_dataset_is_named(world: World) -> None:
    answer = world.client.get(f"/v1/datasets/{world.submit()}/images/12")
    assert answer.status_code == 404
    assert problem(answer) == {
        "field": "index",
        "value": 12,
        "remedy": "Name an index from 0 to 11.",
    }


@pytest.mark.parametrize("part", ["images/-1", "images/x", "shards/-1/objects/samples.tar"])
def test_a_number_that_is_none_is_named(world: World, part: str) -> None:
    answer = world.client.get(f"/v1/datasets/{world.submit()}/{part}")
    assert answer.status_code == 422
    assert problem(answer)["field"] in {"index", "number"}


def test_a_changed_object_is_never_served(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    item = world.client.get(f"/v1/datasets/{dataset_id}/manifest").json()["shards"][0]["objects"][0]
    damaged = bytearray(world.store.get(item["key"]))
    damaged[512] ^= 1  # the first byte of the first image
    world.store.put(item["key"], bytes(damaged), hashlib.sha256(damaged).hexdigest())
    answer = world.client.get(f"/v1/datasets/{dataset_id}/images/0")
    assert answer.status_code == 502
    assert "hi5 audit" in answer.json()["detail"]
    assert world.client.get(f"/v1/datasets/{dataset_id}/images/1").status_code == 200


def test_a_shard_downloads_as_the_tar_it_is(world: World) -> None:
    dataset_id = world.submit()
    world.deliver()
    answer = world.client.get(object_address(dataset_id, 0))
    assert answer.headers["content-type"] == "application/x-tar"
    assert int(answer.headers["content-length"]) == len(answer.content)
    assert answer.headers["etag"] == f'"{hashlib.sha256(answer.content).hexdigest()}"'
    with tarfile.open(fileobj=io.BytesIO(answer.content)) as tar:
        assert tar.getnames()[:2] == ["000000000.jpg", "000000000.json"]


@pytest.mark.parametrize(
    ("asked", "start", "stop"),
    [("bytes=0-99", 0, 100), ("bytes=700-", 700, None), ("bytes=-10", -10, None)],
)
def test_a_range_of_a_shard_downloads(
    world: World, asked: str, start: int, stop: int | None
) -> None:
    address = object_address(world.submit(), 0)
    world.deliver()
    whole = world.client.get(address).content
    part = world.client.get(address, headers={"Range": asked})
    assert part.status_code == 206
    assert part.content == whole[start:stop]
    first = len(whole) + start if start < 0 else start
    last = first + len(part.content) - 1
    assert part.headers["content-range"] == f"bytes {first}-{last}/{len(whole)}"


def test_a_range_beyond_the_end_is_named(world: World) -> None:
    address = object_address(world.submit(), 0)
    world.deliver()
    answer = world.client.get(address, headers={"Range": "bytes=99999999-"})
    assert answer.status_code == 416
    assert answer.headers["content-range"].startswith("bytes */")
    assert problem(answer)["field"] == "Range"


@pytest.mark.parametrize(
    ("number", "name", "field"),
    [(0, "secrets.txt", "name"), (0, "..%2Fhi5.sqlite", "path"), (9, "samples.tar", "number")],
)
def test_no_other_object_can_be_had(world: World, number: int, name: str, field: str) -> None:
    dataset_id = world.submit()
    world.deliver()
    answer = world.client.get(object_address(dataset_id, number, name))
    assert answer.status_code == 404
    assert problem(answer)["field"] == field
