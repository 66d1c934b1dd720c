"""What the probe of a store finds, on good ones and on bad ones."""

import hashlib
import threading
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from hi5_common.cli.checks.services import service_checks
from hi5_common.settings import Settings
from hi5_common.storage.open import memory_store, open_store
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.probe import FOLDER, StoreUnfit, probe
from tests.support.faulty_s3 import Fault, FaultyS3, Kind, faulty_proxy
from tests.support.servers import S3Server


@pytest.fixture(scope="module")
def proxy(s3_server: S3Server) -> Iterator[FaultyS3]:
    with faulty_proxy(s3_server) as proxy:
        yield proxy


@pytest.fixture(params=["memory", "folder", pytest.param("s3", marks=pytest.mark.integration)])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> ObjectStore:
    match request.param:
        case "memory":
            return memory_store()
        case "folder":
            return open_store(Settings(store_url=f"file://{tmp_path / 'store'}"))
    server: S3Server = request.getfixturevalue("s3_server")
    return open_store(Settings.model_validate(server.settings(uuid.uuid4().hex)))


def test_a_good_store_is_fit_and_nothing_is_left(store: ObjectStore) -> None:
    probe(store)
    assert list(store.list(FOLDER)) == []


@pytest.mark.integration
@pytest.mark.parametrize(
    ("kind", "fault", "told"),
    [
        (Kind.PUT, Fault.FORBIDDEN, "put: .*HI5_S3_ACCESS_KEY_ID"),
        (Kind.PUT, Fault.NOT_FOUND, "put: .*not found"),
        (Kind.PUT, Fault.SWALLOWED, "head: .*no object"),
        (Kind.PUT, Fault.SPOILT, "get: bytes: '1024 with SHA-256"),
        (Kind.PUT, Fault.SILENT, "put: "),
        (Kind.HEAD, Fault.NOT_FOUND, "head: .*no object"),
        (Kind.GET, Fault.FLIPPED, "get: bytes: '1024 with SHA-256"),
        (Kind.GET, Fault.UNAVAILABLE, "get: "),
        (Kind.LIST, Fault.FORBIDDEN, "list: "),
        (Kind.LIST, Fault.REPEATING, "list: keys"),
        (Kind.DELETE, Fault.FORBIDDEN, "delete: .*HI5_S3_ACCESS_KEY_ID"),
        (Kind.DELETE, Fault.DENIED_INSIDE, "delete: "),
        (Kind.DELETE, Fault.NOT_FOUND, "delete: .*not found"),
        (Kind.DELETE, Fault.SWALLOWED, "delete: keys"),
    ],
)
def test_a_bad_store_is_unfit_and_the_step_is_named(
    proxy: FaultyS3, kind: Kind, fault: Fault, told: str
) -> None:
    proxy.heal()
    store = open_store(Settings.model_validate(proxy.settings(uuid.uuid4().hex)), 1.0)
    proxy.always[kind] = fault
    with pytest.raises(StoreUnfit, match=told):
        probe(store)


class _Gullible:
    """A store that takes any bytes."""

    def __init__(self, inner: ObjectStore) -> None:
        self._inner = inner

    def __getattr__(self, name: str) -> object:
        return getattr(self._inner, name)

    def put(self, key: str, source: bytes, _sha256: str) -> None:
        self._inner.put(key, source, hashlib.sha256(source).hexdigest())


def test_a_store_that_takes_wrong_bytes_is_unfit() -> None:
    with pytest.raises(StoreUnfit, match=r"refusal of wrong bytes: an object was taken"):
        probe(_Gullible(memory_store()))  # type: ignore[arg-type]  # takes any bytes, by intent


@pytest.mark.integration
def test_the_doctor_gives_a_silent_store_up(proxy: FaultyS3) -> None:
    proxy.heal()
    for kind in Kind:
        proxy.always[kind] = Fault.SILENT
    settings = Settings.model_validate(proxy.settings(uuid.uuid4().hex))
    (check,) = (one for one in service_checks(settings) if one.name == "object store")
    results = []
    thread = threading.Thread(target=lambda: results.append(check.run()), daemon=True)
    thread.start()
    thread.join(settings.lease_s / 2)
    (result,) = results
    assert not result.ok
    assert result.found.startswith("put: ")
    assert "HI5_STORE_URL" in result.remedy


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    settings = Settings(data_dir=tmp_path, store_url=f"file://{tmp_path / 'file'}")
    (check,) = (one for one in service_checks(settings) if one.name == "object store")
    result = check.run()
    assert (result.ok, result.found[:5]) == (False, "put: ")
