"""Signing in: by a one-time link or with a key; what a session may, and when it ends."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from hi5_common.db import browser_tokens, keys
from hi5_common.db.browser_tokens import TokenKind
from hi5_common.db.keys import Granted
from hi5_common.domain.access import Quota, Scope
from tests.api.world import SPEC, World, a_world, bearer, make_key


@contextmanager
def browser(world: World, **headers: str) -> Iterator[httpx.Client]:
    """Yield a client that keeps cookies, follows nothing by itself, and shows no key."""
    base = world.client.base_url
    with httpx.Client(base_url=base, headers=headers, timeout=60) as client:
        yield client


def origin(world: World) -> str:
    return str(world.client.base_url).rstrip("/")


def link(world: World, key: str, valid_s: float = 60) -> str:
    with world.parts.database.transaction() as session:
        key_id = key.split("_")[1]
        return browser_tokens.begin(session, TokenKind.LINK, key_id, valid_s)


def sign_in(client: httpx.Client, key: str, following: str = "/") -> httpx.Response:
    return client.post(
        "/login",
        data={"key": key, "next": following},
        headers={"Origin": str(client.base_url).rstrip("/")},
    )


def test_a_link_signs_in_once_and_leaves_the_address(world: World) -> None:
    token = link(world, make_key(world.parts, scope=Scope.ADMIN))
    with browser(world) as first, browser(world) as second:
        answer = first.get(f"/?token={token}&limit=2")
        assert (answer.status_code, answer.headers["location"]) == (303, "/?limit=2")
        cookie = answer.headers["set-cookie"]
        for flag in ("HttpOnly", "SameSite=strict", "Path=/", "Max-Age=43200"):
            assert flag in cookie
        assert "Secure" not in cookie
        assert token not in cookie
        assert answer.headers["referrer-policy"] == "no-referrer"
        page = first.get("/")
        assert page.status_code == 200
        assert "local · admin" in page.text
        again = first.get(f"/?token={token}")
        assert (again.status_code, again.headers["location"]) == (303, "/")
        late = second.get(f"/?token={token}")
        assert late.headers["location"] == "/login?next=%2F&reason=link"
        assert "set-cookie" not in late.headers
        assert "used before" in second.get(late.headers["location"]).text


def test_a_link_that_is_too_old_or_of_a_revoked_key_signs_nobody_in(world: World) -> None:
    key = make_key(world.parts)
    old, orphaned = link(world, key, valid_s=-1), link(world, key)
    with world.parts.database.transaction() as session:
        keys.revoke(session, key.split("_")[1])
    with browser(world) as client:
        for token in (old, orphaned, "x" * 5000):
            assert "reason=link" in client.get(f"/?token={token}").headers["location"]


def test_who_is_not_signed_in_is_led_to_the_page_and_back(world: World) -> None:
    dataset_id = world.submit()
    page = f"/datasets/{dataset_id}?from=0"
    with browser(world) as client:
        away = client.get(page)
        assert away.status_code == 303
        asked = client.get(away.headers["location"])
        assert 'type="password"' in asked.text
        assert asked.headers["cache-control"] == "no-store"
        (following,) = re.findall(r'name="next" value="([^"]+)"', asked.text)
        entered = sign_in(client, world.client.headers["authorization"][7:], following)
        assert (entered.status_code, entered.headers["location"]) == (303, page)
        assert client.get(page).status_code == 200


@pytest.mark.parametrize(
    "following", ["//evil", "https://evil", "/\\evil", "evil", "/\nx", "javascript:alert(1)", ""]
)
def test_signing_in_leads_nowhere_else(shared_world: World, following: str) -> None:
    with browser(shared_world) as client:
        entered = sign_in(client, shared_world.client.headers["authorization"][7:], following)
        assert (entered.status_code, entered.headers["location"]) == (303, "/")
        shown = client.get("/login", params={"next": following})
        assert "evil" not in shown.text
        assert "javascript:" not in shown.text


def test_a_wrong_key_is_told_and_not_shown_again(shared_world: World) -> None:
    good = shared_world.client.headers["authorization"][7:]
    with browser(shared_world) as client:
        for key in (good[:-1], "", "hi5", "<script>"):
            answer = sign_in(client, key)
            assert answer.status_code == 401
            assert "set-cookie" not in answer.headers
            assert 'role="alert"' in answer.text
            assert good[:-1] not in answer.text
            assert "<script>" not in answer.text.replace('<script type="module"', "")


def test_a_session_of_a_key_to_read_changes_nothing(shared_world: World) -> None:
    place = f"/v1/datasets/{shared_world.submit()}"
    own = {"Origin": origin(shared_world)}
    with browser(shared_world) as client:
        sign_in(client, make_key(shared_world.parts, scope=Scope.READ))
        assert client.get(place).status_code == 200
        assert client.post(f"{place}/cancel", headers=own).status_code == 403


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": "OWN"}, 202),
        ({"Origin": "OWN", "Sec-Fetch-Site": "same-origin"}, 202),
        ({"Origin": "null", "Sec-Fetch-Site": "same-origin"}, 202),
        ({"Sec-Fetch-Site": "same-origin"}, 202),
        ({}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://evil"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
        ({"Origin": "OWN.evil"}, 403),
        ({"Origin": "http://evil", "Sec-Fetch-Site": "same-origin"}, 403),
        ({"Origin": "OWN", "Sec-Fetch-Site": "cross-site"}, 403),
        ({"Origin": "OWN", "Sec-Fetch-Site": "same-site"}, 403),
        ({"Sec-Fetch-Site": "none"}, 403),
    ],
)
def test_only_our_own_pages_change_things_by_cookie(
    shared_world: World, headers: dict[str, str], status: int
) -> None:
    place = f"/v1/datasets/{shared_world.submit()}"
    sent = {name: value.replace("OWN", origin(shared_world)) for name, value in headers.items()}
    with browser(shared_world) as client:
        sign_in(client, shared_world.client.headers["authorization"][7:])
        assert client.post(f"{place}/cancel", headers=sent).status_code == status
        assert client.get(place).json()["status"] == ("cancelled" if status == 202 else "pending")


@pytest.mark.parametrize(
    "strange", ["http://[", "http://", "", "null, null", "file://", "x" * 9000]
)
def test_a_strange_origin_is_foreign(shared_world: World, strange: str) -> None:
    with browser(shared_world, Origin=strange) as client:
        assert client.post("/login", data={"key": "x"}).status_code == 403


@pytest.mark.parametrize("host", ["127.0.0.1:99999", "[::1]:1", "localhost", "127.0.0.1:00080"])
def test_a_strange_port_is_no_fault(shared_world: World, host: str) -> None:
    with browser(shared_world, Host=host) as client:
        assert client.get("/").status_code == 303
        assert client.get("/v1/datasets").status_code == 401
        assert client.get("/?token=x").status_code == 303
        assert client.post("/logout", headers={"Origin": f"http://{host}"}).status_code == 204


def test_another_sites_form_signs_nobody_in_or_out(shared_world: World) -> None:
    key = shared_world.client.headers["authorization"][7:]
    with browser(shared_world) as client:
        assert client.post("/login", data={"key": key}).status_code == 403
        foreign = {"Origin": "http://evil"}
        assert client.post("/login", data={"key": key}, headers=foreign).status_code == 403
        sign_in(client, key)
        assert client.post("/logout", headers=foreign).status_code == 403
        assert client.get("/").status_code == 200


@pytest.mark.parametrize(
    ("content", "media_type", "status"),
    [
        ("key=x", "text/plain", 415),
        ('{"key": "x"}', "application/json", 415),
        (b"key=\xff", "application/x-www-form-urlencoded", 422),
        ("&".join(f"f{n}=1" for n in range(99)), "application/x-www-form-urlencoded", 422),
        ("", "application/x-www-form-urlencoded", 401),
    ],
)
def test_what_is_no_form_of_ours_is_refused(
    shared_world: World, content: str | bytes, media_type: str, status: int
) -> None:
    headers = {"Origin": origin(shared_world), "Content-Type": media_type}
    with browser(shared_world, **headers) as client:
        assert client.post("/login", content=content).status_code == status


def test_signing_out_ends_the_session_everywhere(world: World) -> None:
    with browser(world) as client:
        sign_in(client, world.client.headers["authorization"][7:])
        kept = dict(client.cookies)
        out = client.post("/logout", headers={"Origin": origin(world)})
        assert out.status_code == 204
        assert "Max-Age=0" in out.headers["set-cookie"]
        assert client.get("/").status_code == 303
    with browser(world) as thief:
        thief.cookies.update(kept)
        assert thief.get("/v1/datasets").status_code == 401


def test_a_session_ends_with_its_time_and_with_its_key(tmp_path: Path) -> None:
    with a_world(tmp_path, session_s=0.001) as world, browser(world) as client:
        sign_in(client, world.client.headers["authorization"][7:])
        assert client.get("/v1/datasets").status_code == 401
    (tmp_path / "b").mkdir()
    with a_world(tmp_path / "b") as world, browser(world) as client:
        key = make_key(world.parts)
        sign_in(client, key)
        assert client.get("/v1/datasets").status_code == 200
        with world.parts.database.transaction() as session:
            keys.revoke(session, key.split("_")[1])
        assert client.get("/v1/datasets").status_code == 401


def test_a_session_is_secure_where_that_is_said(tmp_path: Path) -> None:
    with a_world(tmp_path, secure_cookies=True) as world, browser(world) as client:
        entered = sign_in(client, world.client.headers["authorization"][7:])
        assert "; Secure" in entered.headers["set-cookie"]


def test_too_many_requests_are_told_how_long_to_wait(tmp_path: Path) -> None:
    with a_world(tmp_path, rate="3/hour") as world:
        answers = [world.client.get("/v1/vocabulary") for _ in range(4)]
        assert [answer.status_code for answer in answers] == [200, 200, 200, 429]
        assert 3000 < int(answers[-1].headers["retry-after"]) <= 3601
        assert answers[-1].json()["type"] == "urn:hi5:problem:rate"
        other = bearer(make_key(world.parts))
        assert world.client.get("/v1/vocabulary", headers=other).status_code == 200
        assert world.client.get("/healthz").status_code == 200


def test_a_quota_names_what_is_left(world: World) -> None:
    granted = Granted("lab", Scope.WRITE, Quota(images=20, pixels=10**9))
    with world.parts.database.transaction() as session:
        headers = bearer(keys.create(session, granted).text)
    assert world.client.post("/v1/datasets", json=dict(SPEC), headers=headers).status_code == 201
    refused = world.client.post("/v1/datasets", json=dict(SPEC), headers=headers)
    assert (refused.status_code, refused.json()["type"]) == (403, "urn:hi5:problem:quota")
    (problem,) = refused.json()["problems"]
    assert (problem["field"], problem["value"]) == ("count", 12)
    assert "of 20 that the key's owner may have, 8 are left" in problem["remedy"]
    assert world.client.post("/v1/datasets", json=dict(SPEC)).status_code == 201
