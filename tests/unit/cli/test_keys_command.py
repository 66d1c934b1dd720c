"""`hi5 keys` against an SQLite file."""

import json
import re
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from hi5_common.domain.api_key import parse_key
from tests.unit.cli.command import Command


@pytest.fixture(autouse=True)
def tables(hi5: Command) -> None:
    assert hi5("migrate").code == 0


def listed(hi5: Command) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(hi5("keys", "list", "--json").out)
    return found


def test_a_key_is_printed_once_with_what_it_may(hi5: Command, tmp_path: Path) -> None:
    made = hi5(
        *("keys", "create", "--owner", "lab", "--scope", "write", "--expires", "90d"),
        *("--images", 1000, "--pixels", 10**9, "--samples", 10**10),
    )
    parsed = parse_key(made.out.strip())
    assert parsed is not None
    (key,) = listed(hi5)
    assert (key["id"], key["owner"], key["scope"]) == (parsed.id, "lab", "write")
    assert key["quota"] == {"images": 1000, "pixels": 10**9, "samples": 10**10}
    lasts = datetime.fromisoformat(key["expires_at"]) - datetime.fromisoformat(key["created_at"])
    assert abs(lasts - timedelta(days=90)) < timedelta(seconds=30)
    table = hi5("keys", "list").out
    assert parsed.id in table
    assert "1,000 images, 1,000,000,000 pixels" in table
    secret = made.out.split("_")[2]
    assert secret not in table + made.err + hi5("keys", "list", "--json").out
    database = (tmp_path / "data" / "hi5.sqlite").read_bytes()
    assert secret.encode() not in database


def test_a_key_is_revoked_by_its_id(hi5: Command) -> None:
    made = json.loads(hi5("keys", "create", "--owner", "lab", "--scope", "read", "--json").out)
    assert made["key"].split("_")[1] == made["id"]
    assert hi5("keys", "revoke", made["id"]).code == 0
    assert listed(hi5)[0]["revoked_at"] is not None
    refused = hi5("keys", "rotate", made["id"])
    assert (refused.code, "revoked" in refused.err) == (2, True)


@pytest.mark.parametrize("overlap", [(), ("--overlap", "2h")])
def test_a_rotated_key_allows_the_same_and_the_old_one_ends(
    hi5: Command, overlap: tuple[str, ...]
) -> None:
    create = ("keys", "create", "--owner", "lab", "--scope", "admin", "--images", "5", "--json")
    old = json.loads(hi5(*create).out)
    new = json.loads(hi5("keys", "rotate", old["id"], *overlap, "--json").out)
    assert new["key"] != old["key"]
    assert [new[name] for name in ("owner", "scope", "quota")] == ["lab", "admin", old["quota"]]
    (ended,) = [key for key in listed(hi5) if key["id"] == old["id"]]
    assert (ended["revoked_at"] is None, ended["expires_at"] is None) == (
        bool(overlap),
        not overlap,
    )


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("create", "--owner", "A b", "--scope", "read"), "owner: A b"),
        (("create", "--owner", "a", "--scope", "read", "--expires", "soon"), "--expires: soon"),
        (("create", "--owner", "a", "--scope", "read", "--images", "0"), "--images"),
        (("create", "--owner", "a", "--scope", "root"), "--scope"),
        (("revoke", "nobody"), "ID: nobody"),
        (("rotate", "nobody"), "ID: nobody"),
    ],
)
def test_what_is_wrong_is_named(hi5: Command, arguments: tuple[str, ...], named: str) -> None:
    finished = hi5("keys", *arguments)
    assert finished.code == 2
    assert named in re.sub(r"\x1b\[[0-9;]*m", "", finished.err)


def test_a_link_needs_a_service(hi5: Command) -> None:
    assert "No `hi5 up` runs" in hi5("keys", "link").err


def test_the_admin_key_is_registered_by_migrating(
    hi5: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    made = json.loads(hi5("keys", "create", "--owner", "x", "--scope", "read", "--json").out)
    monkeypatch.setenv("HI5_DATA_DIR", str(tmp_path / "other"))
    file = tmp_path / "admin_key"
    file.write_text(made["key"])
    monkeypatch.setenv("HI5_ADMIN_KEY_FILE", str(file))
    for _ in range(2):
        assert hi5("migrate").code == 0
    (key,) = listed(hi5)
    assert (key["id"], key["scope"], key["owner"]) == (made["id"], "admin", "local")
