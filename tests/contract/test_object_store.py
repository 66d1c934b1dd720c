"""What any object store promises: memory, a folder, and S3 (SeaweedFS)."""

import hashlib
import uuid
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from hi5_common.settings import Settings
from hi5_common.storage import errors
from hi5_common.storage.obstore_store import PART_BYTES
from hi5_common.storage.open import memory_store, open_store
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.publish import publish, verify
from tests.support.servers import S3Server

KEY = "datasets/d/shards/000000/attempt-0001/samples.tar"


@pytest.fixture(params=["memory", "folder", pytest.param("s3", marks=pytest.mark.integration)])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> ObjectStore:
    if request.param == "memory":
        return memory_store()
    if request.param == "folder":
        return open_store(Settings(store_url=f"file://{tmp_path / 'not' / 'there yet'}"))
    server = request.getfixturevalue("s3_server")
    assert isinstance(server, S3Server)
    return open_store(Settings.model_validate(server.settings(uuid.uuid4().hex)))


def sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def put(store: ObjectStore, key: str, data: bytes) -> None:
    store.put(key, data, sha256(data))


def test_what_was_put_comes_back(store: ObjectStore) -> None:
    put(store, KEY, b"0123456789")
    assert store.get(KEY) == b"0123456789"
    assert store.head(KEY).size_bytes == 10
    assert b"".join(store.stream(KEY)) == b"0123456789"


def test_an_empty_object_is_an_object(store: ObjectStore) -> None:
    put(store, KEY, b"")
    assert store.get(KEY) == b""
    assert store.head(KEY).size_bytes == 0


@pytest.mark.parametrize(
    ("start", "stop", "expected"),
    [(0, 3, b"012"), (8, 10, b"89"), (8, 99, b"89"), (10, 12, b""), (4, 4, b"")],
)
def test_ranges(store: ObjectStore, start: int, stop: int, expected: bytes) -> None:
    put(store, KEY, b"0123456789")
    assert store.get_range(KEY, start, stop) == expected


def test_a_file_in_several_parts(store: ObjectStore, tmp_path: Path) -> None:
    path = tmp_path / "large"
    path.write_bytes(b"hi5!" * (PART_BYTES // 4) + b"and a bit more")
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    stored = publish(store, KEY, path, digest)
    assert (stored.size_bytes, stored.sha256) == (PART_BYTES + 14, digest)
    assert store.get_range(KEY, PART_BYTES - 4, PART_BYTES + 3) == b"hi5!and"


def test_putting_again_replaces(store: ObjectStore) -> None:
    put(store, KEY, b"first")
    put(store, KEY, b"second")
    assert store.get(KEY) == b"second"


def test_wrong_bytes_are_not_stored(store: ObjectStore) -> None:
    with pytest.raises(errors.WrongBytes):
        store.put(KEY, b"these", sha256(b"those"))
    with pytest.raises(errors.ObjectMissing):
        store.get(KEY)


def test_publishing_reads_back(store: ObjectStore, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"good")
    stored = publish(store, KEY, path, sha256(b"good"))
    put(store, KEY, b"evil")
    with pytest.raises(errors.WrongBytes, match="SHA-256"):
        verify(store, stored)
    put(store, KEY, b"goo")
    with pytest.raises(errors.WrongBytes, match="3 bytes, not 4"):
        verify(store, stored)


def test_a_missing_object_is_missing(store: ObjectStore) -> None:
    for read in (store.get, store.head, lambda key: list(store.stream(key))):
        with pytest.raises(errors.ObjectMissing, match=KEY):
            read(KEY)
    with pytest.raises(errors.ObjectMissing):
        store.get_range(KEY, 0, 1)


def test_listing_and_deleting(store: ObjectStore) -> None:
    put(store, "a/b/one", b"1")
    put(store, "a/b/c/two", b"22")
    put(store, "a/bc/three", b"333")
    assert {e.key: e.size_bytes for e in store.list("a/b")} == {"a/b/one": 1, "a/b/c/two": 2}
    store.delete(["a/b/one", "a/b/c/two", "a/b/never"])
    assert list(store.list("a/b")) == []
    assert [entry.key for entry in store.list("a")] == ["a/bc/three"]


@pytest.mark.parametrize(
    "key", ["", "/a", "a/", "a//b", "../a", "a/../b", "a/.b", "a%2e", "a\\b", "ä", "a b", "a" * 501]
)
def test_keys_that_could_mean_two_things_are_refused(store: ObjectStore, key: str) -> None:
    for use in (lambda: put(store, key, b""), lambda: store.get(key), lambda: store.delete([key])):
        with pytest.raises(errors.InvalidKey):
            use()


def test_writers_of_one_key_leave_one_whole_object(store: ObjectStore) -> None:
    whole = [bytes([number]) * 100_000 for number in range(8)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda data: put(store, KEY, data), whole))
    assert store.get(KEY) in whole
    assert len(list(store.list("datasets"))) == 1


@pytest.mark.integration
def test_wrong_credentials_are_refused(s3_server: S3Server) -> None:
    settings = s3_server.settings("x") | {"s3_secret_access_key": "wrong"}
    store = open_store(Settings.model_validate(settings))
    with pytest.raises(errors.StoreRefused, match="HI5_S3_ACCESS_KEY_ID"):
        put(store, KEY, b"")


def test_a_store_that_is_away_is_unavailable(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    store = open_store(Settings(store_url=f"file://{tmp_path / 'file'}"))
    with pytest.raises(errors.StoreUnavailable):
        put(store, KEY, b"")
