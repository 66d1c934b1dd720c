"""Reads straight from the store: for minutes, of one object, and without our key."""

import hashlib
import http.server
import threading
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import parse_qs, urlsplit
from uuid import UUID

import httpx
import pytest

from hi5_common.cli.client import Service
from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.keys import SAMPLES
from hi5_common.settings import Settings
from hi5_common.storage.open import open_signed_reads, open_store
from tests.api.world import SPEC
from tests.support.api_process import ApiProcess, api_process
from tests.support.servers import S3Server

pytestmark = pytest.mark.integration

MOST_S = 900


@pytest.fixture(scope="module")
def api(tmp_path_factory: pytest.TempPathFactory, s3_server: S3Server) -> Iterator[ApiProcess]:
    settings = s3_server.settings(uuid.uuid4().hex) | {"s3_public_endpoint": s3_server.endpoint}
    with api_process(tmp_path_factory.mktemp("signed"), None, **settings) as found:
        yield found


@pytest.fixture(scope="module")
def dataset_id(api: ApiProcess) -> UUID:
    with api.client() as client:
        made = client.post("/v1/datasets", json=SPEC).json()
    api.deliver()
    return UUID(made["id"])


def path(dataset_id: UUID, name: str = SAMPLES) -> str:
    return f"/v1/datasets/{dataset_id}/shards/0/objects/{name}"


def location(api: ApiProcess, dataset_id: UUID) -> str:
    with api.client() as client:
        answer = client.get(path(dataset_id))
    assert answer.status_code == 307
    assert answer.headers["cache-control"] == "no-store"
    return answer.headers["location"]


def test_a_whole_file_is_read_from_the_store(api: ApiProcess, dataset_id: UUID) -> None:
    url = location(api, dataset_id)
    with api.client() as client:
        shard = client.get(f"/v1/datasets/{dataset_id}/manifest").json()["shards"][0]
    content = httpx.get(url).raise_for_status().content
    assert hashlib.sha256(content).hexdigest() == shard["objects"][0]["sha256"]


def test_the_address_is_good_for_minutes_and_names_no_secret(
    api: ApiProcess, dataset_id: UUID
) -> None:
    url = location(api, dataset_id)
    assert 0 < int(parse_qs(urlsplit(url).query)["X-Amz-Expires"][0]) <= MOST_S
    assert str(api.settings.s3_secret_access_key) not in url


def test_the_address_is_of_one_object_and_one_method(api: ApiProcess, dataset_id: UUID) -> None:
    url = location(api, dataset_id)
    wrong = {
        "another object": url.replace(SAMPLES, "labels.parquet"),
        "a later end": url.replace("X-Amz-Expires=300", "X-Amz-Expires=900"),
        "another signature": url[:-1] + ("0" if url[-1] != "0" else "1"),
        "no signature": url.partition("?")[0],
    }
    for name, changed in wrong.items():
        assert changed != url
        assert httpx.get(changed).status_code in {400, 401, 403}, name
    for method in ("PUT", "DELETE", "POST"):
        assert httpx.request(method, url).status_code in {400, 401, 403, 405}, method
    assert httpx.get(url).status_code == 200  # and it is still there


def test_ranges_and_headers_come_from_the_api_itself(api: ApiProcess, dataset_id: UUID) -> None:
    with api.client() as client:
        part = client.get(path(dataset_id), headers={"Range": "bytes=0-9"})
        head = client.head(path(dataset_id))
        image = client.get(f"/v1/datasets/{dataset_id}/images/0")
    assert (part.status_code, len(part.content)) == (206, 10)
    assert (head.status_code, image.status_code) == (200, 200)
    assert "location" not in head.headers


def test_the_client_follows_and_leaves_its_key_behind(api: ApiProcess, dataset_id: UUID) -> None:
    with Service(api.url, api.key) as service:
        content = b"".join(service.stream(path(dataset_id)))
    assert len(content) > 1000


def test_no_key_goes_to_another_host() -> None:
    with (
        recording({}) as (store, heard),
        recording({"Location": f"{store}/there"}) as (first, heard_first),
        Service(first, "hi5_secret") as service,
    ):
        assert b"".join(service.stream("/here")) == b"done"
    assert [headers.get("Authorization") for headers in heard_first] == ["Bearer hi5_secret"]
    assert [headers.get("Authorization") for headers in heard] == [None]


@contextmanager
def recording(moved: dict[str, str]) -> Iterator[tuple[str, list[dict[str, str]]]]:
    """Serve one answer for everything; yield the address and the headers that come in."""
    heard: list[dict[str, str]] = []

    class Answer(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            heard.append(dict(self.headers))
            self.send_response(307 if moved else 200)
            for name, value in (moved | {"Content-Length": "4"}).items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(b"done")

        def log_message(self, *_: object) -> None:
            return

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Answer)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", heard
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def test_it_is_off_unless_asked_for_and_only_for_s3(tmp_path: Path, s3_server: S3Server) -> None:
    assert open_signed_reads(Settings.model_validate(s3_server.settings("a"))) is None
    folder = Settings(data_dir=tmp_path, s3_public_endpoint="https://store.example")
    with pytest.raises(InvalidInput, match="HI5_S3_PUBLIC_ENDPOINT"):
        open_signed_reads(folder)
    open_store(folder)
