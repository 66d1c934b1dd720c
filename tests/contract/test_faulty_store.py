"""Every fault of an S3 store that its script knows, at every kind of request.

The invariant: what publish() returns is in the store, whole and right, as seen without the proxy;
whatever else happens is one of the errors that the port names.
"""

import random
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from hi5_common.settings import Settings
from hi5_common.storage import errors
from hi5_common.storage.obstore_store import PART_BYTES, digest
from hi5_common.storage.open import open_store
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.publish import publish, verify
from hi5_common.storage.removal import remove_listed
from tests.support.faulty_s3 import Fault, FaultyS3, Kind, faulty_proxy
from tests.support.servers import S3Server

pytestmark = pytest.mark.integration

TROUBLE = (errors.StoreUnavailable, errors.StoreRefused, errors.WrongBytes)
SMALL_BYTES = 20_000
PATIENCE_S = 2.0

_EVERYWHERE = (
    *(Fault.UNAVAILABLE, Fault.INTERNAL, Fault.LANDED_INTERNAL, Fault.LANDED_UNAVAILABLE),
    *(Fault.LANDED_CUT, Fault.CUT_UP, Fault.SILENT, Fault.NOT_FOUND, Fault.FORBIDDEN),
)
FAULTS: dict[Kind, tuple[Fault, ...]] = {
    Kind.PUT: (
        *_EVERYWHERE,
        *(Fault.LANDED_SILENT, Fault.SLOW, Fault.CONFLICT, Fault.PRECONDITION),
        *(Fault.SWALLOWED, Fault.SPOILT),
    ),
    Kind.GET: (*_EVERYWHERE, Fault.CUT_DOWN, Fault.SLOW, Fault.FLIPPED, Fault.SHORTENED),
    Kind.HEAD: _EVERYWHERE,
    Kind.PARTS: (
        *_EVERYWHERE,
        *(Fault.CUT_DOWN, Fault.CONFLICT, Fault.SHORTENED, Fault.SWALLOWED),
    ),
    Kind.LIST: (
        *_EVERYWHERE,
        *(Fault.CUT_DOWN, Fault.SHORTENED, Fault.LAGGING, Fault.REPEATING),
    ),
    Kind.DELETE: (
        *_EVERYWHERE,
        *(Fault.CUT_DOWN, Fault.SHORTENED, Fault.CONFLICT, Fault.SWALLOWED),
        Fault.DENIED_INSIDE,
    ),
}
WRITING = [(kind, fault) for kind in (Kind.PUT, Kind.GET, Kind.HEAD) for fault in FAULTS[kind]]
REMOVING = [(kind, fault) for kind in (Kind.LIST, Kind.DELETE) for fault in FAULTS[kind]]
PARTS = [(Kind.PARTS, fault) for fault in FAULTS[Kind.PARTS]]


class World:
    """A folder of the bucket, seen through the proxy and without it."""

    def __init__(self, proxy: FaultyS3, folder: Path, patience_s: float = PATIENCE_S) -> None:
        prefix = uuid.uuid4().hex
        self.proxy = proxy
        self.folder = folder
        settings = Settings.model_validate(proxy.settings(prefix))
        direct = Settings.model_validate(proxy.server.settings(prefix))
        self.store: ObjectStore = open_store(settings, patience_s)
        self.truth: ObjectStore = open_store(direct)

    def publish(self, key: str, size_bytes: int = SMALL_BYTES, seed: int = 0) -> bool:
        """Publish a file; return whether it went well, having made sure that it is there then."""
        path = self.folder / uuid.uuid4().hex
        path.write_bytes(random.Random(seed).randbytes(size_bytes))
        try:
            stored = publish(self.store, key, path, digest(path))
        except TROUBLE:
            return False
        finally:
            self.proxy.heal()
        verify(self.truth, stored)
        return True

    def names(self) -> list[str]:
        return sorted(entry.key for entry in self.truth.list("o"))


@pytest.fixture(scope="module")
def running_proxy(s3_server: S3Server) -> Iterator[FaultyS3]:
    with faulty_proxy(s3_server) as proxy:
        yield proxy


@pytest.fixture
def proxy(running_proxy: FaultyS3) -> FaultyS3:
    running_proxy.heal()
    running_proxy.seen.clear()
    return running_proxy


@pytest.mark.parametrize(("kind", "fault"), WRITING)
def test_one_fault_costs_no_publication(
    proxy: FaultyS3, tmp_path: Path, kind: Kind, fault: Fault
) -> None:
    world = World(proxy, tmp_path)
    proxy.script(kind, fault)
    assert world.publish("o/a") is (fault is not Fault.FORBIDDEN)
    assert any(seen.fault is fault for seen in proxy.seen)


@pytest.mark.parametrize(("kind", "fault"), PARTS)
def test_one_fault_costs_no_publication_in_parts(
    proxy: FaultyS3, tmp_path: Path, kind: Kind, fault: Fault
) -> None:
    world = World(proxy, tmp_path)
    proxy.script(kind, fault)
    assert world.publish("o/a", PART_BYTES + 1000) is (fault is not Fault.FORBIDDEN)
    assert any(seen.fault is fault for seen in proxy.seen)


@pytest.mark.parametrize(("kind", "fault"), WRITING)
def test_a_fault_without_end_publishes_nothing_wrong(
    proxy: FaultyS3, tmp_path: Path, kind: Kind, fault: Fault
) -> None:
    world = World(proxy, tmp_path, patience_s=0.5)
    proxy.always[kind] = fault
    assert not world.publish("o/a")


def test_the_worst_faults_are_told_apart(proxy: FaultyS3, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"right")
    wanted = [
        (Kind.PUT, Fault.SPOILT, errors.WrongBytes, "SHA-256 is"),
        (Kind.GET, Fault.FLIPPED, errors.WrongBytes, "SHA-256 is"),
        (Kind.GET, Fault.SHORTENED, errors.WrongBytes, "4 bytes, not 5"),
        (Kind.PUT, Fault.SWALLOWED, errors.StoreUnavailable, "knows nothing of it"),
        (Kind.HEAD, Fault.NOT_FOUND, errors.StoreUnavailable, "knows nothing of it"),
        (Kind.PUT, Fault.NOT_FOUND, errors.StoreUnavailable, "not found"),
        (Kind.PUT, Fault.FORBIDDEN, errors.StoreRefused, "HI5_S3_ACCESS_KEY_ID"),
    ]
    for kind, fault, error, words in wanted:
        proxy.heal()
        proxy.always[kind] = fault
        with pytest.raises(error, match=words):
            publish(World(proxy, tmp_path).store, "o/a", path, digest(path))


@pytest.mark.parametrize(("kind", "fault"), REMOVING)
def test_one_fault_leaves_nothing_behind_at_the_second_sweep(
    proxy: FaultyS3, tmp_path: Path, kind: Kind, fault: Fault
) -> None:
    world = World(proxy, tmp_path)
    for name in ("o/a", "o/b", "o/c", "o/kept"):
        assert world.publish(name, 100)
    proxy.script(kind, None, fault)
    for _ in range(2):
        try:
            removal = remove_listed(world.store, "o", lambda key: key != "o/kept")
        except TROUBLE:
            continue
        assert "o/kept" in world.names()
        assert not removal.clean or world.names() == ["o/kept"]
    assert world.names() == ["o/kept"]


def test_a_store_that_only_says_it_deletes_is_not_clean(proxy: FaultyS3, tmp_path: Path) -> None:
    world = World(proxy, tmp_path)
    assert world.publish("o/a", 100)
    proxy.always[Kind.DELETE] = Fault.SWALLOWED
    removal = remove_listed(world.store, "o", lambda _key: True)
    assert (removal.removed, removal.clean) == (1, False)


@pytest.mark.parametrize("seed", range(60))
def test_any_order_of_faults(proxy: FaultyS3, tmp_path: Path, seed: int) -> None:
    """Publish and remove under a shower of faults, then in peace: nothing wrong, nothing left."""
    rng = random.Random(seed)
    world = World(proxy, tmp_path)
    published: set[str] = set()
    for number in range(4):
        for _ in range(rng.randint(1, 4)):
            kind = rng.choice([Kind.PUT, Kind.GET, Kind.HEAD])
            fault = rng.choice([fault for fault in FAULTS[kind] if fault not in _WAITING])
            proxy.script(kind, *[None] * rng.randint(0, 2), fault)
        key = f"o/{number}"
        if world.publish(key, rng.randint(1, SMALL_BYTES), seed):
            published.add(key)
        kind = rng.choice([Kind.LIST, Kind.DELETE])
        proxy.script(kind, rng.choice([f for f in FAULTS[kind] if f not in _WAITING]))
        try:
            remove_listed(world.store, "o", lambda key: key not in published)
        except TROUBLE:
            pass
        finally:
            proxy.heal()
        assert published <= set(world.names())
    assert remove_listed(world.store, "o", lambda key: key not in published).clean
    assert set(world.names()) == published


_WAITING = (Fault.SILENT, Fault.LANDED_SILENT, Fault.SLOW)
