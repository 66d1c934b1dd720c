"""Every route against every kind of caller: who gets in, and that nothing leaks to the others."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, cast
from uuid import UUID, uuid4

import httpx
import pytest
from fastapi import APIRouter, FastAPI
from fastapi.routing import APIRoute
from starlette.routing import Mount, Route

from hi5_common.db import keys
from hi5_common.db.keys import Granted
from hi5_common.domain.access import Scope
from hi5_common.domain.api_key import ID_BYTES, SECRET_BYTES, key_text
from services.api.access import doors
from services.api.main import ROUTERS
from tests.api.world import SPEC, World, bearer, make_key

OPEN = {"/healthz", "/readyz", "/login", "/logout"}
CHANGES = {
    ("POST", "/v1/datasets"),
    ("POST", "/v1/datasets/{dataset_id}/cancel"),
    ("POST", "/v1/datasets/{dataset_id}/retry"),
    ("DELETE", "/v1/datasets/{dataset_id}"),
}
"""What needs a key of scope write: written down here a second time, so that no door is changed by
mistake."""
FOR_ALL = {("GET", "/v1/workers"), ("POST", "/v1/workers/{name}/unblock")}
"""What needs a key of scope admin: it tells of everybody's datasets."""
PAGES = {"/", "/datasets/{dataset_id}", "/datasets/{dataset_id}/audit"}


@dataclass(frozen=True)
class Way:
    """A route and one of its methods."""

    method: str
    path: str

    @property
    def scope(self) -> Scope:
        mine = self.method, self.path
        if mine in FOR_ALL:
            return Scope.ADMIN
        return Scope.WRITE if mine in CHANGES else Scope.READ

    @property
    def is_of_a_dataset(self) -> bool:
        return "{dataset_id}" in self.path

    @property
    def is_page(self) -> bool:
        return self.path in PAGES

    def address(self, dataset_id: UUID) -> str:
        return self.path.format(dataset_id=dataset_id, index=0, number=0, name="samples.tar")


ROUTES = [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute)]
WAYS = sorted(
    (
        Way(method, route.path)
        for route in ROUTES
        for method in cast(set[str], route.methods)
        if route.path not in OPEN
    ),
    key=lambda way: (way.path, way.method),
)


@dataclass(frozen=True)
class Callers:
    """Keys by what is wrong with them, and whose they are."""

    world: World
    plain: httpx.Client
    by_name: dict[str, str]
    sought: UUID
    """A delivered dataset of the owner's, which others look for."""

    def ask(self, name: str, way: Way, dataset_id: UUID) -> httpx.Response:
        """Send what the route takes, with a key."""
        headers = bearer(self.by_name[name]) if name != "no key" else {}
        body = {"json": dict(SPEC)} if (way.method, way.path[:4]) == ("POST", "/v1/") else {}
        if way.is_of_a_dataset:
            body = {}
        address = way.address(dataset_id)
        return self.plain.request(way.method, address, headers=headers, **cast(Any, body))


REFUSED = ("no key", "malformed", "wrong", "revoked", "expired")


@pytest.fixture(scope="module")
def callers(shared_world: World) -> Iterator[Callers]:
    parts = shared_world.parts
    made = {
        "owner": make_key(parts, "ann"),
        "reader": make_key(parts, "ann", Scope.READ),
        "other": make_key(parts, "bob"),
        "admin": make_key(parts, "root", Scope.ADMIN),
        "revoked": make_key(parts, "ann"),
        "wrong": key_text(bytes(ID_BYTES + SECRET_BYTES)),
    }
    made["malformed"] = made["owner"][:-1]
    with parts.database.transaction() as session:
        keys.revoke(session, made["revoked"].split("_")[1])
        made["expired"] = keys.create(session, Granted("ann", Scope.WRITE, valid_s=-1)).text
    with httpx.Client(base_url=shared_world.client.base_url, timeout=120) as plain:
        found = Callers(shared_world, plain, made, UUID(int=0))
        yield replace(found, sought=a_dataset(found))


def a_dataset(callers: Callers, owner: str = "owner") -> UUID:
    """Return a delivered dataset of four images."""
    headers = bearer(callers.by_name[owner])
    body = {**SPEC, "count": 4}
    answer = callers.plain.post("/v1/datasets", json=body, headers=headers)
    assert answer.status_code == 201, answer.text
    deliver_all(callers.world, answer.headers["location"], headers)
    return UUID(answer.json()["id"])


def deliver_all(world: World, place: str, headers: dict[str, str]) -> None:
    while world.client.get(place, headers=headers).json()["status"] != "complete":
        world.deliver()


def as_if_it_were(text: str, dataset_id: UUID, other: UUID) -> str:
    return text.replace(str(dataset_id), str(other))


# ------------------------------------------------------------------------------- default deny


def test_each_route_has_a_door_or_is_open_on_purpose(shared_world: World) -> None:
    undeclared = {route.path for route in ROUTES if doors.scope_of(route) is None}
    assert undeclared == OPEN == set(doors.OPEN)
    app = shared_world.app
    others = {
        getattr(route, "path", ""): type(route)
        for route in app.routes
        if "router" not in type(route).__name__.lower()
    }
    assert others == {"/openapi.json": Route, "/static": Mount}
    included = len(app.routes) - len(others)
    assert included == len(ROUTERS)


def test_each_door_asks_for_the_scope_that_the_route_needs() -> None:
    declared = {
        (method, route.path): doors.scope_of(route)
        for route in ROUTES
        for method in cast(set[str], route.methods)
        if route.path not in OPEN
    }
    assert declared == {(way.method, way.path): way.scope for way in WAYS}
    assert len(WAYS) >= 20
    assert {(way.method, way.path) for way in WAYS} >= CHANGES


def test_a_route_without_a_door_is_not_served() -> None:
    careless = APIRouter()

    @careless.get("/v1/secrets")
    def secrets() -> str:
        return "all"

    with pytest.raises(RuntimeError, match="/v1/secrets"):
        doors.require_doors([careless])
    mounted = APIRouter()
    mounted.mount("/files", FastAPI())
    with pytest.raises(RuntimeError, match="no door"):
        doors.require_doors([mounted])


# ------------------------------------------------------------------------------- the matrix


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("way", WAYS, ids=lambda way: f"{way.method} {way.path}")
def test_who_shows_no_good_key_learns_nothing(callers: Callers, way: Way, name: str) -> None:
    real, unknown = (callers.ask(name, way, each) for each in (callers.sought, uuid4()))
    if way.is_page and name == "no key":
        assert real.status_code == unknown.status_code == 303
        assert real.headers["location"].startswith("/login?next=%2F")
        return
    assert real.status_code == unknown.status_code == 401
    assert real.headers["www-authenticate"] == 'Bearer realm="hi5"'
    told, expected = real.json(), unknown.json()
    assert told.pop("instance") == real.url.path
    expected.pop("instance")
    assert told == expected
    shown = callers.by_name.get(name, "").split("_")
    assert all(len(part) < 6 or part not in real.text for part in shown)


@pytest.mark.parametrize("way", WAYS, ids=lambda way: f"{way.method} {way.path}")
def test_a_key_to_read_opens_what_is_read(callers: Callers, way: Way) -> None:
    answer = callers.ask("reader", way, callers.sought)
    if way.scope is Scope.READ:
        assert answer.status_code in {200, 202}, answer.text
        return
    unknown = callers.ask("reader", way, uuid4())
    assert answer.status_code == unknown.status_code == 403
    assert answer.json()["problems"][0]["field"] == "scope"
    assert callers.ask("owner", Way("GET", "/v1/datasets/{dataset_id}"), callers.sought).is_success


@pytest.mark.parametrize("way", WAYS, ids=lambda way: f"{way.method} {way.path}")
def test_what_belongs_to_another_owner_is_not_there(callers: Callers, way: Way) -> None:
    answer = callers.ask("other", way, callers.sought)
    if way.scope is Scope.ADMIN:
        assert answer.status_code == 403
        return
    if not way.is_of_a_dataset:
        assert answer.is_success, answer.text
        assert str(callers.sought) not in answer.text
        return
    absent = uuid4()
    unknown = callers.ask("other", way, absent)
    assert answer.status_code == unknown.status_code == 404
    assert as_if_it_were(answer.text, callers.sought, absent) == unknown.text
    varying = {"date"}
    assert {k: v for k, v in answer.headers.items() if k not in varying} == {
        k: v for k, v in unknown.headers.items() if k not in varying
    }


@pytest.mark.parametrize("name", ["owner", "admin"])
@pytest.mark.parametrize("way", WAYS, ids=lambda way: f"{way.method} {way.path}")
def test_the_owner_and_an_administrator_may(callers: Callers, way: Way, name: str) -> None:
    mine = a_dataset(callers) if way.scope is Scope.WRITE else callers.sought
    answer = callers.ask(name, way, mine)
    if way.scope is Scope.ADMIN and name != "admin":
        assert answer.status_code == 403
        return
    # A complete dataset cannot be cancelled, and has nothing to retry: that is said to who may.
    allowed = {200, 201, 202, 204} | ({409} if way.path.endswith("cancel") else set())
    allowed |= {404} if way.path.endswith("unblock") else set()  # there is no such machine
    assert answer.status_code in allowed, answer.text


# ------------------------------------------------------------------------------- owners


def test_lists_have_only_ones_own_and_an_administrators_has_all(callers: Callers) -> None:
    theirs = a_dataset(callers, "other")

    def seen(name: str) -> set[str]:
        headers = bearer(callers.by_name[name])
        found: set[str] = set()
        address: str | None = "/v1/datasets?limit=3"
        while address:
            page = callers.world.client.get(address, headers=headers).json()
            found |= {item["id"] for item in page["items"]}
            address = page["next"]
        return found

    ann, bob, root = (seen(name) for name in ("owner", "other", "admin"))
    assert str(callers.sought) in ann
    assert str(theirs) in bob
    assert not ann & bob
    assert root >= ann | bob
    assert seen("reader") == ann


def test_owners_may_use_the_same_idempotency_key(callers: Callers) -> None:
    def submit(name: str, seed: int) -> httpx.Response:
        headers = {**bearer(callers.by_name[name]), "Idempotency-Key": "monday"}
        body = {**SPEC, "seed": seed}
        return callers.world.client.post("/v1/datasets", json=body, headers=headers)

    first, theirs, again = submit("owner", 5), submit("other", 6), submit("owner", 5)
    assert [answer.status_code for answer in (first, theirs, again)] == [201, 201, 200]
    assert first.json()["id"] == again.json()["id"] != theirs.json()["id"]
    assert submit("other", 5).status_code == 409


def test_only_ones_own_dataset_is_taken_over(callers: Callers) -> None:
    world = callers.world
    base = {**SPEC, "count": 4, "seed": 77}
    made = world.client.post("/v1/datasets", json=base, headers=bearer(callers.by_name["owner"]))
    assert made.status_code == 201
    deliver_all(world, made.headers["location"], bearer(callers.by_name["owner"]))
    more = {**base, "count": 8, "extends": made.json()["spec"]}

    def done(name: str) -> int:
        headers = bearer(callers.by_name[name])
        answer = world.client.post("/v1/datasets", json=more, headers=headers)
        assert answer.status_code == 201, answer.text
        count: int = answer.json()["progress"]["done"]
        return count

    assert (done("other"), done("admin"), done("owner")) == (0, 0, 4)


def test_the_key_comes_before_the_body(callers: Callers) -> None:
    for content in ('{"count": 0}', "{", "\xff"):
        answer = httpx.post(
            callers.world.client.base_url.join("/v1/datasets"), content=content, headers={}
        )
        assert answer.status_code == 401


@pytest.mark.parametrize(
    "header",
    [
        "Bearer",
        "Basic {}",
        "bearer{}",
        "{}",
        "Bearer {} {}",
        "Bearer {}\u00e9",
        "Token {}",
    ],
)
def test_a_header_that_is_not_quite_right_lets_nobody_in(callers: Callers, header: str) -> None:
    sent = header.replace("{}", callers.by_name["owner"]).encode("latin-1")
    url = callers.world.client.base_url.join("/v1/datasets")
    answer = httpx.get(url, headers={b"Authorization": sent})
    assert answer.status_code == 401
    assert answer.json()["problems"][0]["value"] == "(not shown)"


def test_programs_that_know_only_passwords_may_read(callers: Callers) -> None:
    def ask(method: str, name: str) -> int:
        password = ("anybody", callers.by_name[name])
        address = "/v1/datasets" if method == "GET" else f"/v1/datasets/{callers.sought}/retry"
        return callers.plain.request(method, address, auth=password).status_code

    assert (ask("GET", "owner"), ask("GET", "revoked"), ask("POST", "owner")) == (200, 401, 401)
    for broken in ("Basic", "Basic ====", "Basic /w=="):
        answer = callers.plain.get("/v1/datasets", headers={"Authorization": broken})
        assert answer.status_code == 401


def test_openapi_says_that_a_key_is_needed(callers: Callers) -> None:
    document = json.loads(httpx.get(callers.world.client.base_url.join("/openapi.json")).text)
    assert document["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    secured = {
        path
        for path, methods in document["paths"].items()
        if all("security" in each for each in methods.values())
    }
    assert set(document["paths"]) - secured == {"/healthz", "/readyz"}
