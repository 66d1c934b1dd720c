"""Two hundred hostile names wherever a name may stand: refused by field, or kept as plain data."""

import json
import socket
from pathlib import Path
from urllib.parse import quote
from uuid import UUID, uuid4

import httpx
import pytest

from hi5_common.domain.keys import parse_attempt
from hi5_common.own_places import find_own
from hi5_common.storage.errors import InvalidKey
from hi5_common.storage.local import LocalFolder
from hi5_common.storage.port import checked_key
from tests.api.world import SPEC, World
from tests.support.hostile import NAMES

LEAST = 200
PROBLEM = "application/problem+json"


def test_there_are_two_hundred() -> None:
    assert len(NAMES) >= LEAST


def assert_refused(answer: httpx.Response, field: str) -> None:
    assert 400 <= answer.status_code < 500, answer.text
    assert answer.headers["content-type"] == PROBLEM
    named = [problem["field"] for problem in answer.json()["problems"]]
    assert any(name.startswith(field) for name in named), (field, answer.text)


@pytest.fixture(scope="module")
def kept(shared_world: World) -> dict[str, UUID]:
    """Submit a dataset of every name; return those that were taken, by name."""
    found: dict[str, UUID] = {}
    for name in NAMES:
        answer = shared_world.client.post("/v1/datasets", json={**SPEC, "name": name})
        if answer.status_code == 201:
            found[name] = UUID(answer.json()["id"])
        else:
            assert_refused(answer, "name")
    return found


def test_a_dataset_s_name_is_refused_or_kept_as_it_is(
    shared_world: World, kept: dict[str, UUID]
) -> None:
    assert 10 < len(kept) < len(NAMES) / 4
    for name, dataset_id in kept.items():
        assert shared_world.client.get(f"/v1/datasets/{dataset_id}").json()["name"] == name
        assert not {*name} & {*"/\\<>&\"'`{}$%|;=*?\n\r\t\0\x1b"}


@pytest.mark.parametrize("path", ["", "/audit"])
def test_a_page_shows_names_escaped(shared_world: World, kept: dict[str, UUID], path: str) -> None:
    for dataset_id in kept.values():
        page = shared_world.client.get(f"/datasets/{dataset_id}{path}")
        assert page.status_code == 200
        assert "alert(1)" not in page.text


def test_an_environment_of_a_hostile_name_is_refused_by_field(shared_world: World) -> None:
    for name in NAMES:
        for value in (name, f"user:../{name}", f"polyhaven:{name}/..", f"user:{name}\n"):
            body = {"count": 1, "attributes": {"environment": [value]}}
            answer = shared_world.client.post("/v1/plans", json=body)
            assert_refused(answer, "attributes.environment")


def test_no_name_leads_a_panorama_s_record_elsewhere(tmp_path: Path) -> None:
    assets = tmp_path / "assets"
    (assets / "user").mkdir(parents=True)
    record = {"file_name": "../secret.json", "sha256": "", "width_px": 1, "height_px": 1}
    (tmp_path / "secret.json").write_text(json.dumps(record), "utf-8")
    for name in (*NAMES, "../../secret", "../secret", str(tmp_path / "secret")):
        assert find_own(assets, f"user:{name}") is None
        assert find_own(assets, name) is None


def routes(world: World) -> list[tuple[str, str]]:
    """Return (method, path with {} in place of one parameter), every parameter of every route."""
    document = world.client.get("/openapi.json", timeout=60).json()
    good = {"dataset_id": str(uuid4()), "number": "0", "index": "0", "name": "samples.tar"}
    found = [("GET", "/datasets/{}"), ("GET", "/datasets/{}/audit"), ("GET", "/static/{}")]
    for path, methods in document["paths"].items():
        names = [part[1:-1] for part in path.split("/") if part.startswith("{")]
        for asked in names:
            filled = path
            for name in names:
                filled = filled.replace(f"{{{name}}}", "{}" if name == asked else good[name])
            found += [(method.upper(), filled) for method in methods]
    return found


def test_every_route_refuses_hostile_parts_of_its_path(shared_world: World) -> None:
    found = routes(shared_world)
    assert len(found) >= 20
    for method, path in found:
        for name in NAMES:
            address = path.format(quote(name, safe=""))
            answer = shared_world.client.request(method, address)
            if answer.status_code == 200:
                # The client itself takes "." and ".." for the folders that they name.
                assert name in {"", ".", ".."}
                continue
            assert 400 <= answer.status_code < 500, (method, address, answer.text)
            assert answer.headers["content-type"] == PROBLEM, (method, address)
            assert "Traceback" not in answer.text


def test_what_a_client_need_not_escape_is_refused_too(shared_world: World) -> None:
    """Paths as they are, no client in between to tidy them up."""
    port = shared_world.client.base_url.port
    for name in NAMES:
        raw = f"/static/{name}".encode("utf-8", "surrogatepass")
        answer = raw_get(int(port or 0), raw)
        assert answer.startswith((b"HTTP/1.1 400 ", b"HTTP/1.1 404 ")), raw


def raw_get(port: int, target: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=60) as connection:
        connection.sendall(
            b"GET " + target + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
        )
        found = b""
        while piece := connection.recv(65_536):
            found += piece
        return found


def test_an_object_key_stays_in_its_folder(tmp_path: Path) -> None:
    root = tmp_path / "store"
    store = LocalFolder(root)
    taken = 0
    for name in NAMES:
        for key in (name, f"datasets/{name}", f"{name}/samples.tar"):
            try:
                checked_key(key)
            except InvalidKey:
                with pytest.raises(InvalidKey):
                    store.head(key)
                continue
            taken += 1
            assert (root / key).resolve().is_relative_to(root.resolve())
            assert parse_attempt(key) is None  # the sweep never takes it for one of ours
    assert 0 < taken < len(NAMES)
    assert list(tmp_path.rglob("*")) == []


def test_an_idempotency_key_is_refused_or_a_key(shared_world: World) -> None:
    for name in NAMES:
        headers = [(b"Idempotency-Key", name.encode("utf-8"))]
        try:
            answer = shared_world.client.post("/v1/datasets", json={"count": 1}, headers=headers)
        except httpx.LocalProtocolError:
            continue  # httpx itself does not send it
        assert answer.status_code in {200, 201, 400, 422}, answer.text
        if answer.status_code >= 400 and answer.headers["content-type"] == PROBLEM:
            assert_refused(answer, "Idempotency-Key")
