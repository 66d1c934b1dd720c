"""What every answer carries, and the small routes: health, vocabulary, schema, OpenAPI."""

import re
from pathlib import Path

import httpx
import pytest

from hi5_common.db.engine import open_database
from hi5_common.domain.vocabulary import KEYPOINTS, VALUES
from hi5_common.queue.errors import BrokerUnavailable
from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.settings import Settings
from hi5_common.storage.local import LocalFolder
from services.api import healthcheck
from services.api.main import assemble
from services.api.parts import Parts
from services.api.settings import ApiSettings
from tests.api.world import World, serving

STATIC = Path(__file__).parents[2] / "services/api/dashboard"


@pytest.mark.parametrize(
    "path", ["/", "/healthz", "/v1/datasets", "/v1/nothing", "/static/live.js", "/openapi.json"]
)
def test_browsers_are_told_to_trust_only_our_own(shared_world: World, path: str) -> None:
    headers = shared_world.client.get(path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "script-src 'self';" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"


def test_pages_have_no_inline_script_style_or_foreign_address(shared_world: World) -> None:
    files = [*STATIC.glob("templates/*"), *STATIC.glob("static/*")]
    assert len(files) >= 7
    for file in files:
        text = file.read_text("utf-8").replace("http://www.w3.org/2000/svg", "")
        assert "://" not in text, file
        assert not re.search(r"<script(?![^>]*src=)|<style|\sstyle=|\son[a-z]+=|innerHTML", text), (
            file
        )


def test_the_vocabulary_is_the_one_of_specs(shared_world: World) -> None:
    vocabulary = shared_world.client.get("/v1/vocabulary").json()
    assert vocabulary["attributes"] == {a.value: list(values) for a, values in VALUES.items()}
    assert vocabulary["keypoints"] == list(KEYPOINTS)
    assert len(vocabulary["skeleton"]) == 20
    assert vocabulary["visibility"]["visible"] == 3


def test_the_schema_spells_the_vocabulary_out(shared_world: World) -> None:
    schema = shared_world.client.get("/v1/spec-schema").json()
    pose = schema["$defs"]["AttributeRequests"]["properties"]["pose"]
    assert pose["anyOf"][1]["items"]["enum"] == list(VALUES["pose"])  # type: ignore[index]


def test_openapi_lists_every_route_of_the_api(shared_world: World) -> None:
    document = shared_world.client.get("/openapi.json").json()
    dataset = "/v1/datasets/{dataset_id}"
    parts = ("manifest", "balance", "audit", "events", "failures", "cancel", "retry")
    assert set(document["paths"]) == {
        "/v1/datasets",
        dataset,
        *(f"{dataset}/{part}" for part in parts),
        *(f"{dataset}/{part}" for part in ("card", "croissant", "licences")),
        f"{dataset}/images/{{index}}",
        f"{dataset}/images/{{index}}/labels",
        f"{dataset}/shards/{{number}}/objects/{{name}}",
        "/v1/plans",
        "/v1/workers",
        "/v1/workers/{name}/unblock",
        "/v1/vocabulary",
        "/v1/spec-schema",
        "/v1/presets",
        "/healthz",
        "/readyz",
    }


def test_ready_when_all_parts_answer(shared_world: World) -> None:
    answer = shared_world.client.get("/readyz")
    assert answer.status_code == 200
    assert answer.json()["ready"] is True
    assert set(answer.json()["parts"]) == {"database", "store", "broker"}


def test_not_ready_says_which_part(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    def away() -> int:
        raise BrokerUnavailable

    monkeypatch.setattr(world.doorbell, "waiting", away)
    answer = world.client.get("/readyz")
    assert answer.status_code == 503
    parts = answer.json()["parts"]
    assert [name for name, state in parts.items() if not state["ok"]] == ["broker"]
    assert world.client.get("/healthz").status_code == 200


def test_a_database_without_tables_is_not_ready_and_says_so(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    database = open_database(settings.resolved_database_url)
    parts = Parts.of(settings, database, LocalFolder(tmp_path / "store"), MemoryDoorbell())
    with serving(assemble(parts, ApiSettings())) as url:
        ready, listed = httpx.get(f"{url}/readyz"), httpx.get(f"{url}/v1/datasets")
    assert ready.status_code == 503
    assert "hi5 migrate" in ready.json()["parts"]["database"]["detail"]
    assert listed.status_code == 503
    assert "hi5 migrate" in listed.json()["detail"]


def test_what_nobody_foresaw_is_a_problem_without_our_insides(
    world: World, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(_: object) -> None:
        raise ZeroDivisionError("the secret of the house")

    monkeypatch.setattr(world.parts.plans, "of", broken)
    answer = world.client.post("/v1/plans", json={"count": 1})
    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert "secret" not in answer.text
    assert "secret" in caplog.text


@pytest.mark.parametrize("host", ["localhost:8000", "127.0.0.1", "[::1]:8000", "LOCALHOST"])
def test_this_machine_has_these_names(shared_world: World, host: str) -> None:
    assert shared_world.client.get("/healthz", headers={"Host": host}).status_code == 200


STRANGE_HOSTS = (
    *("localhost/x](", 'localhost"b<script>', "localhost/x", "localhost:8000/x", "localhost?x"),
    *(
        "evil@localhost",
        "localhost:80:80",
        "localhost:x",
        "[::1",
        "::1",
        "[localhost]",
        "local host",
    ),
)


@pytest.mark.parametrize("host", STRANGE_HOSTS)
def test_what_is_more_than_a_host_is_refused(shared_world: World, host: str) -> None:
    answer = shared_world.client.get("/healthz", headers={"Host": host})
    assert answer.status_code == 400
    assert answer.json()["problems"][0]["field"] == "Host"
    assert answer.json()["instance"] == "/healthz"


def test_any_host_can_be_allowed(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path)
    database = open_database(settings.resolved_database_url)
    parts = Parts.of(settings, database, LocalFolder(tmp_path / "store"), MemoryDoorbell())
    with serving(assemble(parts, ApiSettings(allowed_hosts=("*",)))) as url:
        for host, status in (
            ("gpu.lab", 200),
            ("gpu_1.lab:8000", 200),
            ("evil.com/x](", 400),
            ('a"b<script>', 400),
        ):
            answer = httpx.get(f"{url}/healthz", headers={"Host": host})
            assert answer.status_code == status, host


def test_the_healthcheck_follows_readiness(
    world: World, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("UVICORN_PORT", str(world.client.base_url.port))
    assert healthcheck.main() == 0

    def away() -> int:
        raise BrokerUnavailable

    monkeypatch.setattr(world.doorbell, "waiting", away)
    assert healthcheck.main() == 1
    assert "broker" in capsys.readouterr().err


@pytest.mark.parametrize("path", ["/", "/v1/datasets", "/openapi.json", "/static/hi5.css"])
def test_what_can_be_got_can_be_asked_for_its_headers(shared_world: World, path: str) -> None:
    whole, head = shared_world.client.get(path), shared_world.client.head(path)
    assert (head.status_code, head.content) == (200, b"")
    same = ("content-type", "content-length", "content-security-policy")
    assert [head.headers[name] for name in same] == [whole.headers[name] for name in same]


def test_a_path_names_every_method_it_takes(shared_world: World) -> None:
    answer = shared_world.client.put("/v1/datasets")
    assert answer.status_code == 405
    assert answer.headers["allow"] == "GET, HEAD, POST"
    assert "GET, HEAD, POST" in answer.json()["detail"]


def test_the_vocabulary_says_what_values_mean_and_what_is_left_out_means(
    shared_world: World,
) -> None:
    found = shared_world.client.get("/v1/vocabulary").json()
    assert found["defaults"]["ring"] == ["none"]
    assert found["defaults"]["environment"] == found["attributes"]["environment"]
    assert list(found["environments"]) == found["attributes"]["environment"]
    assert found["environments"]["night"]["light_level"] == "low"
    assert found["environments"]["night"]["licence"] == "CC0-1.0"
    assert found["shapes"]["age"] == {"low": 18, "high": 90, "average": 35, "unit": "years"}
    assert found["ita_range_deg"] == [-90, 70]
    assert list(found["affect"]) == found["attributes"]["pose"]


def test_a_spec_with_numbers_is_planned_by_their_spelling(shared_world: World) -> None:
    spec = {"count": 6, "attributes": {"skin_tone": [41.0, "dark"], "age": {"30": 2, "40..50": 4}}}
    plan = shared_world.client.post("/v1/plans", json=spec).json()
    assert plan["values"]["skin_tone"] == {"41": 3, "dark": 3}
    assert plan["values"]["age"] == {"30": 2, "40..50": 4}
    assert {cell["age"] for cell in plan["first_cells"]} == {"30", "40..50"}
