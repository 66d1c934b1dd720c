"""Each rule of the API broken once: a 4xx problem that names the field, the value, the remedy."""

from dataclasses import dataclass, field
from typing import Any
from uuid import UUID, uuid4

import httpx
import pytest

from tests.api.world import SPEC, World

JSON, YAML = "application/json", "application/yaml"
ABSENT = UUID("01890000-0000-7000-8000-000000000000")


@dataclass(frozen=True)
class Wrong:
    """A request that breaks one rule, and what the answer must name."""

    name: str
    where: str
    value: object
    remedy: str
    status: int = 422
    method: str = "POST"
    path: str = "/v1/datasets"
    content: bytes | str | None = None
    body: dict[str, Any] | None = None
    headers: dict[str, str] = field(default_factory=dict)


def spec(case: str, /, where: str, value: object, remedy: str, **changes: object) -> Wrong:
    return Wrong(case, where, value, remedy, body={**SPEC, **changes})


def attributes(case: str, /, where: str, value: object, remedy: str, **asked: object) -> Wrong:
    return spec(case, f"attributes.{where}", value, remedy, attributes=asked)


def text(name: str, where: str, value: object, remedy: str, content: bytes | str) -> Wrong:
    return Wrong(name, where, value, remedy, content=content, headers={"Content-Type": YAML})


def get(name: str, where: str, value: object, remedy: str, path: str, status: int = 422) -> Wrong:
    return Wrong(name, where, value, remedy, status, "GET", path)


WRONG = (
    Wrong("count missing", "count", None, "required", body={"name": "x"}),
    spec("count zero", "count", 0, "greater than or equal to 1", count=0),
    spec("count negative", "count", -5, "greater than or equal to 1", count=-5),
    spec("count too large", "count", 2_000_000_000, "less than or equal to", count=2_000_000_000),
    spec("count a string", "count", "12", "valid integer", count="12"),
    spec("count a fraction", "count", 1.5, "valid integer", count=1.5),
    spec("count true", "count", True, "valid integer", count=True),
    spec("unknown field", "colour", "red", "Known fields: name, seed, count", colour="red"),
    spec("misspelled field", "sead", 1, "Did you mean seed?", sead=1),
    spec("seed negative", "seed", -1, "greater than or equal to 0", seed=-1),
    spec("name empty", "name", "", "at least 1 character", name=""),
    spec("name with a slash", "name", "../etc", "match pattern", name="../etc"),
    spec("width too small", "image.width", 8, "greater than or equal to 16", image={"width": 8}),
    spec("height too large", "image.height", 9000, "less than or equal", image={"height": 9000}),
    spec("unknown format", "image.format", "gif", "'jpeg' or 'png'", image={"format": "gif"}),
    spec("jpeg_quality 0", "image.jpeg_quality", 0, "equal to 1", image={"jpeg_quality": 0}),
    spec("unknown image field", "image.depth", 8, "Known fields: width", image={"depth": 8}),
    spec("unknown quality", "render.quality", "best", "'draft'", render={"quality": "best"}),
    spec("unknown label", "labels.0", "depth", "'keypoints'", labels=["depth"]),
    spec("no labels", "labels", "[]", "at least 1 item", labels=[]),
    spec("label twice", "labels", "box", "once", labels=["box", "box"]),
    spec("shard size 0", "images_per_shard", 0, "greater than or equal", images_per_shard=0),
    Wrong(
        "too many shards",
        "images_per_shard",
        1,
        "ask for 10 or leave it out",
        body={"count": 1_000_000, "images_per_shard": 1},
    ),
    attributes("unknown attribute", "mood", ["sad"], "Known fields: gender", mood=["sad"]),
    attributes("unknown value", "pose", "fists", "Did you mean fist?", pose=["fists"]),
    attributes("band backwards", "age", "30..18", "Did you mean 18..30?", age=["30..18"]),
    attributes("angle too dark", "skin_tone", "-91", "from -90 to 70", skin_tone=[-91]),
    attributes("value twice", "gender", "male", "once", gender=["male", "male"]),
    attributes("empty list", "skin_tone", "[]", "at least one value", skin_tone=[]),
    attributes(
        "counts do not add up", "gender", "{'male': 5}", "ask for 7 more here", gender={"male": 5}
    ),
    attributes("count below zero", "gender.male", -1, "0 or more", gender={"male": -1}),
    attributes(
        "count of an unknown value", "handedness", "both", "right, left", handedness={"both": 12}
    ),
    text("yaml that is none", "spec", "while parsing", "Write YAML", "count: [1"),
    text("yaml key twice", "spec", "key 'count'", "Write YAML", "count: 1\ncount: 2\n"),
    text("yaml list", "spec", "['count']", "Send a mapping", "- count\n"),
    text("yaml with a tag", "spec", "constructor", "Write YAML", "!!python/object:os.x {}"),
    text("empty body", "spec", None, "Send a mapping", ""),
    text("not utf-8", "body", "b'\\xff'", "Send UTF-8", b"name: \xff\n"),
    Wrong(
        "json cut off", "body", "Expecting", "RFC 8259", content="{", headers={"content-type": JSON}
    ),
    Wrong(
        "json name twice",
        "body",
        "name 'count' is written twice",
        "each name once",
        content='{"count": 1, "count": 2}',
        headers={"content-type": JSON},
    ),
    Wrong(
        "json NaN",
        "body",
        "NaN",
        "RFC 8259",
        content='{"count": NaN}',
        headers={"content-type": JSON},
    ),
    Wrong(
        "media type",
        "Content-Type",
        "text/plain",
        "application/yaml",
        415,
        content="count: 1",
        headers={"Content-Type": "text/plain"},
    ),
    Wrong("no media type", "Content-Type", "", "application/json", 415, content=b"count: 1"),
    Wrong(
        "body too large",
        "body",
        str(2 << 20),
        "at most 1048576 bytes",
        413,
        content=b"#" * (2 << 20),
        headers={"Content-Type": YAML},
    ),
    Wrong(
        "idempotency key too long",
        "Idempotency-Key",
        "k" * 197 + "...",
        "at most 200",
        body=dict(SPEC),
        headers={"Idempotency-Key": "k" * 201},
    ),
    Wrong(
        "idempotency key not printable",
        "Idempotency-Key",
        "a\tb",
        "match pattern",
        body=dict(SPEC),
        headers={"Idempotency-Key": "a\tb"},
    ),
    Wrong("plan of a wrong spec", "count", 0, "equal to 1", path="/v1/plans", body={"count": 0}),
    get("no such route", "path", "/v1/dataset", "/openapi.json", "/v1/dataset", 404),
    Wrong("no such method", "method", "PUT", "takes", 405, method="PUT"),
    get("id is no uuid", "dataset_id", "7", "valid UUID", "/v1/datasets/7"),
    get("no such dataset", "dataset_id", str(ABSENT), "lists", f"/v1/datasets/{ABSENT}", 404),
    get("limit too large", "limit", "201", "less than or equal", "/v1/datasets?limit=201"),
    get("limit a word", "limit", "many", "valid integer", "/v1/datasets?limit=many"),
    get("unknown parameter", "page", "2", "Leave it out", "/v1/datasets?page=2"),
    get("cursor is no id", "after", "x", "valid UUID", "/v1/datasets?after=x"),
    get("unknown attribute to cross", "a", "mood", "'gender'", f"/datasets/{ABSENT}?a=mood"),
    get("foreign host", "Host", "evil.example", "HI5_API_ALLOWED_HOSTS", "/healthz", 400),
    Wrong(
        "another site's page",
        "Origin",
        "cross-site",
        "own pages",
        403,
        path=f"/v1/datasets/{ABSENT}/cancel",
        headers={"Sec-Fetch-Site": "cross-site"},
    ),
)


def send(world: World, wrong: Wrong) -> httpx.Response:
    headers = dict(wrong.headers)
    if wrong.where == "Host":
        headers["Host"] = str(wrong.value)
    return world.client.request(
        wrong.method, wrong.path, content=wrong.content, json=wrong.body, headers=headers
    )


def assert_problem(
    answer: httpx.Response, status: int, where: str, value: object, remedy: str
) -> None:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document = answer.json()
    assert set(document) == {"type", "title", "status", "detail", "instance", "problems"}
    assert document["status"] == status
    assert document["type"].startswith("urn:hi5:problem:")
    assert document["instance"] == answer.url.path
    named = {problem["field"]: problem for problem in document["problems"]}
    assert where in named, document
    found = named[where]
    if isinstance(value, str):
        assert value in str(found["value"]), found
    else:
        assert found["value"] == value or found["value"] == repr(value), found
        assert type(found["value"]) is type(value) or isinstance(value, list), found
    assert remedy in found["remedy"], found
    assert where in document["detail"]


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.name)
def test_a_broken_rule_is_named(shared_world: World, wrong: Wrong) -> None:
    answer = send(shared_world, wrong)
    assert_problem(answer, wrong.status, wrong.where, wrong.value, wrong.remedy)


def test_nothing_wrong_was_stored(shared_world: World) -> None:
    for wrong in WRONG:
        send(shared_world, wrong)
    assert shared_world.client.get("/v1/datasets").json()["items"] == []


def test_at_least_thirty_rules_are_broken_each_once() -> None:
    assert len({wrong.name for wrong in WRONG}) == len(WRONG) >= 30


def test_every_problem_is_named_at_once(shared_world: World) -> None:
    body = {"count": 0, "seed": -1, "labels": [], "image": {"width": 1}}
    problems = shared_world.client.post("/v1/datasets", json=body).json()["problems"]
    assert {problem["field"] for problem in problems} == {"count", "seed", "labels", "image.width"}


def test_a_body_that_streams_without_a_length_is_cut_off(shared_world: World) -> None:
    pieces = (b"#" * 65536 for _ in range(20))
    headers = {"Content-Type": YAML}
    answer = shared_world.client.post("/v1/datasets", content=pieces, headers=headers)
    assert_problem(answer, 413, "body", "more than", "at most")


@pytest.mark.parametrize(
    "path",
    [
        "manifest",
        "balance",
        "events",
        "images/0",
        "images/0/labels",
        "shards/0/objects/samples.tar",
    ],
)
def test_no_part_of_an_unknown_dataset_is_found(shared_world: World, path: str) -> None:
    unknown = uuid4()
    answer = shared_world.client.get(f"/v1/datasets/{unknown}/{path}")
    assert_problem(answer, 404, "dataset_id", str(unknown), "GET /v1/datasets")


@pytest.mark.parametrize(
    ("method", "path"), [("POST", "/cancel"), ("POST", "/retry"), ("DELETE", "")]
)
def test_nothing_can_be_done_to_an_unknown_dataset(
    shared_world: World, method: str, path: str
) -> None:
    unknown = uuid4()
    answer = shared_world.client.request(method, f"/v1/datasets/{unknown}{path}")
    assert_problem(answer, 404, "dataset_id", str(unknown), "GET /v1/datasets")
