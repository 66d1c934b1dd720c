"""Bodies that are meant to hurt: every answer is a small problem, soon, and never a 500."""

import json
from typing import Any

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.api.world import World

YAML, JSON = {"Content-Type": "application/yaml"}, {"Content-Type": "application/json"}
MAX_ANSWER_BYTES = 64 << 10

BOMB = "\n".join(
    ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
)
HOSTILE_YAML = {
    "a reference bomb": BOMB,
    "a reference bomb as a request": BOMB + "\ncount: 5\nattributes: {pose: *a11}",
    "a reference to itself": "count: &a [*a]",
    "a number of 5000 digits": "count: " + "9" * 5000,
    "a hexadecimal number of 5000 digits": "count: 0x" + "f" * 5000,
    "a day that is none": "count: 2026-99-99",
    "a day": "count: 2026-01-01",
    "infinity": "count: .inf",
    "bytes": "count: !!binary aGk=",
    "a set": "count: !!set {a, b}",
    "a list as a key": "? [a, b]\n: 1",
    "a number as a key": "1: 2",
    "deep nesting": "[" * 100_000,
    "half a surrogate pair": 'name: "\\ud800"',
    "a null byte": "name: \x00",
    "twenty thousand unknown fields": "\n".join(f"f{n}: 1" for n in range(20_000)),
    "twenty thousand unknown values": f"count: 1\nattributes: {{pose: [{'x, ' * 20_000}]}}",
}
HOSTILE_JSON = {
    "deep nesting": '{"count": ' + "[" * 200_000,
    "a number of 5000 digits": '{"count": ' + "9" * 5000 + "}",
    "a number beyond floats": '{"count": 1e999}',
    "half a surrogate pair": '{"name": "\\ud800", "count": 1}',
    "half a surrogate pair in a name": '{"\\ud800": 1}',
    "many unknown fields": json.dumps({f"f{n}": n for n in range(60_000)}),
    "many repeated values": json.dumps({"count": 1, "attributes": {"pose": ["fist"] * 60_000}}),
}


def assert_small_problem(answer: httpx.Response) -> None:
    assert 400 <= answer.status_code < 500, answer.text[:500]
    assert answer.headers["content-type"] == "application/problem+json"
    assert len(answer.content) < MAX_ANSWER_BYTES
    assert answer.json()["problems"]


@pytest.mark.parametrize("path", ["/v1/datasets", "/v1/plans"])
@pytest.mark.parametrize("name", HOSTILE_YAML)
def test_hostile_yaml(shared_world: World, name: str, path: str) -> None:
    content = HOSTILE_YAML[name].encode()
    assert_small_problem(shared_world.client.post(path, content=content, headers=YAML, timeout=60))


@pytest.mark.parametrize("name", HOSTILE_JSON)
def test_hostile_json(shared_world: World, name: str) -> None:
    content = HOSTILE_JSON[name].encode()
    answer = shared_world.client.post("/v1/plans", content=content, headers=JSON, timeout=60)
    assert_small_problem(answer)


def test_a_plan_of_a_billion_images_is_arithmetic(shared_world: World) -> None:
    answer = shared_world.client.post("/v1/plans", json={"count": 1_000_000_000}, timeout=60)
    assert answer.status_code == 200, answer.text
    assert sum(answer.json()["values"]["pose"].values()) == 1_000_000_000


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=12,
)
fields = st.sampled_from(["count", "seed", "attributes", "image", "labels", "name", "render"])


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(document=st.dictionaries(fields, json_values, max_size=5))
def test_no_json_document_breaks_the_planner(shared_world: World, document: dict[str, Any]) -> None:
    body = json.dumps(document).encode()
    answer = shared_world.client.post("/v1/plans", content=body, headers=JSON, timeout=60)
    assert answer.status_code == 200 or 400 <= answer.status_code < 500, (document, answer.text)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(body=st.binary(max_size=60) | st.text(max_size=60).map(str.encode))
def test_no_bytes_break_the_parser(shared_world: World, body: bytes) -> None:
    answer = shared_world.client.post("/v1/plans", content=body, headers=YAML, timeout=60)
    assert_small_problem(answer)
