"""Attempts and sweeps against an S3 store that fails by a script.

The invariant, however a store fails: a row that says "published" has its objects, whole and right;
a failed attempt says `store` or `wrong_bytes` and comes back; nothing that a row points to is ever
deleted; and in the end the store holds exactly what rows point to.
"""

import random
import uuid
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

import pytest

from hi5_common.cli.fetch.audit import AuditReport, audit
from hi5_common.cli.fetch.audit import Fault as Damage
from hi5_common.cli.fetch.direct_source import DirectSource
from hi5_common.db import datasets, migrate, shards
from hi5_common.db.engine import Database, open_database
from hi5_common.db.errors import LeaseLost
from hi5_common.domain import keys, retry
from hi5_common.domain.records import Publication, Shard, ShardStatus, StoredObject, Tallies
from hi5_common.domain.retry import FailureKind
from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.settings import Settings
from hi5_common.storage import errors
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.open import open_store
from hi5_common.storage.port import ObjectStore
from hi5_common.storage.publish import publish, verify
from hi5_common.storage.removal import TROUBLES_IN_A_ROW
from services.worker.fleet.shard_runner import Outcome
from services.worker.keeper import Keeper
from tests.contract.test_faulty_store import FAULTS
from tests.support import factories, runners
from tests.support.faulty_s3 import Fault, FaultyS3, Kind, faulty_proxy
from tests.support.servers import S3Server

pytestmark = pytest.mark.integration

PATIENCE_S = 1.5
STEPS = ("claim", "claim", "upload", "upload", "upload", "upload", "finish", "end", "sweep")
_WAITING = (Fault.SILENT, Fault.LANDED_SILENT, Fault.SLOW)
_NAMES = (keys.SAMPLES, keys.LABELS, keys.MEMBERS)


@dataclass
class World:
    """A database and a folder of a bucket, through the proxy and without it."""

    database: Database
    proxy: FaultyS3
    folder: Path
    prefix: str = field(default_factory=lambda: uuid.uuid4().hex)

    @property
    def truth(self) -> ObjectStore:
        return open_store(Settings.model_validate(self.proxy.server.settings(self.prefix)))

    def store(self) -> ObjectStore:
        settings = Settings.model_validate(self.proxy.settings(self.prefix))
        return open_store(settings, PATIENCE_S)

    def keeper(self) -> Keeper:
        settings = runners.settings(self.folder, lease_s=1, renew_s=0.3)
        return Keeper(self.database, self.store(), MemoryDoorbell(), settings)

    def shards(self) -> list[Shard]:
        with self.database.snapshot() as session:
            found = datasets.page(session, 50)
            return [s for one in found for s in shards.of_dataset(session, one.id, 100)]

    def referenced(self) -> list[StoredObject]:
        published = [s.publication for s in self.shards() if s.status is ShardStatus.DONE]
        assert all(published)
        return [one for p in published if p for one in (p.samples, p.labels, p.members)]

    def check(self) -> None:
        """Read every object that a row points to."""
        truth = self.truth
        for stored in self.referenced():
            verify(truth, stored)

    def shower(self, rng: random.Random, kinds: list[Kind], most: int) -> None:
        """Script some faults that do not keep the test waiting."""
        for _ in range(rng.randint(1, most)):
            kind = rng.choice(kinds)
            fault = rng.choice([one for one in FAULTS[kind] if one not in _WAITING])
            self.proxy.script(kind, *[None] * rng.randint(0, 3), fault)


@pytest.fixture(scope="module")
def running_proxy(s3_server: S3Server) -> Iterator[FaultyS3]:
    with faulty_proxy(s3_server) as proxy:
        yield proxy


@pytest.fixture
def world(
    running_proxy: FaultyS3, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[World]:
    monkeypatch.setattr(retry, "FIRST_DELAY_S", 0.0)
    running_proxy.heal()
    url = f"sqlite:///{tmp_path / 'hi5.sqlite'}"
    migrate.upgrade(url)
    database = open_database(url)
    yield World(database, running_proxy, tmp_path)
    database.dispose()


@pytest.mark.parametrize("seed", range(16))
def test_whole_attempts(world: World, seed: int) -> None:
    rng = random.Random(seed)
    made = factories.dataset(world.database, count=2, size=1)
    slot = runners.runner(world.database, world.store(), world.folder)
    for _ in range(retry.MAX_FAILURES * 2):
        world.shower(rng, [Kind.PUT, Kind.GET, Kind.HEAD], 6)
        outcome = slot.run_next(None)
        world.check()
        if outcome is None:
            break
        assert outcome in (Outcome.PUBLISHED, Outcome.FAILED)
        for shard in world.shards():
            if shard.failure_reason:
                assert shard.failure_reason.startswith(("store: ", "wrong_bytes: "))
    world.proxy.heal()
    assert {shard.status for shard in world.shards()} <= {ShardStatus.DONE, ShardStatus.FAILED}
    assert any(shard.status is ShardStatus.DONE for shard in world.shards())
    world.keeper().sweep_objects()
    left = {entry.key for entry in world.truth.list(keys.dataset_prefix(made.id))}
    assert left == {stored.key for stored in world.referenced()}


@pytest.mark.parametrize(
    ("kind", "fault", "reason"),
    [
        (Kind.PUT, Fault.UNAVAILABLE, "store: "),
        (Kind.PUT, Fault.SPOILT, "wrong_bytes: "),
        (Kind.PUT, Fault.SWALLOWED, "store: "),
        (Kind.PUT, Fault.FORBIDDEN, "store: "),
        (Kind.PUT, Fault.NOT_FOUND, "store: "),
        (Kind.PUT, Fault.CONFLICT, "store: "),
        (Kind.GET, Fault.FLIPPED, "wrong_bytes: "),
        (Kind.GET, Fault.NOT_FOUND, "store: "),
        (Kind.HEAD, Fault.NOT_FOUND, "store: "),
    ],
)
def test_a_failed_attempt_names_the_store_and_is_tried_again(
    world: World, kind: Kind, fault: Fault, reason: str
) -> None:
    factories.dataset(world.database, count=1, size=1)
    slot = runners.runner(world.database, world.store(), world.folder)
    world.proxy.always[kind] = fault
    assert slot.run_next(None) is Outcome.FAILED
    (shard,) = world.shards()
    assert shard.status is ShardStatus.PENDING
    assert str(shard.failure_reason).startswith(reason)
    world.proxy.heal()
    assert slot.run_next(None) is Outcome.PUBLISHED
    world.check()


@dataclass
class _Attempt:
    """A worker that has a shard, and some of its files in the store."""

    shard: Shard
    stored: list[StoredObject] = field(default_factory=list)
    ended: bool = False


@dataclass
class _Workers:
    """Attempts without a renderer, each a step at a time."""

    world: World
    store: ObjectStore
    rng: random.Random
    attempts: list[_Attempt] = field(default_factory=list)

    def claim(self) -> bool:
        with self.world.database.transaction() as session:
            shard = shards.claim(session, None, "w", 60)
        if shard is not None:
            self.attempts.append(_Attempt(shard))
        return shard is not None

    def any(self) -> _Attempt | None:
        return self.rng.choice(self.attempts) if self.attempts else None

    def upload(self) -> None:
        """Store the next file of an attempt, which may have lost its shard meanwhile."""
        attempt = self.any()
        if attempt is None or len(attempt.stored) == len(_NAMES):
            return
        shard, name = attempt.shard, _NAMES[len(attempt.stored)]
        path = self.world.folder / uuid.uuid4().hex
        path.write_bytes(self.rng.randbytes(800))
        key = f"{keys.shard_prefix(shard.dataset_id, shard.number, shard.attempt)}/{name}"
        try:
            attempt.stored.append(publish(self.store, key, path, digest(path)))
        except (errors.StoreUnavailable, errors.StoreRefused, errors.WrongBytes):
            self.end(attempt, FailureKind.STORE)

    def finish(self) -> None:
        whole = [one for one in self.attempts if len(one.stored) == len(_NAMES)]
        if not whole:
            return
        attempt = self.rng.choice(whole)
        samples, labels, members = attempt.stored
        publication = Publication(samples, labels, members, 1, Tallies({}, {}))
        shard = attempt.shard
        attempt.ended = True
        with suppress(LeaseLost), self.world.database.transaction() as session:
            shards.finish(session, shard.id, shard.attempt, "w", publication)

    def end(self, attempt: _Attempt | None, kind: FailureKind) -> None:
        if attempt is None:
            return
        shard = attempt.shard
        attempt.ended = True
        with suppress(LeaseLost), self.world.database.transaction() as session:
            shards.fail(session, shard.id, shard.attempt, "w", kind, "by the test")

    def fence(self) -> None:
        """Let those that lost their shard notice, as they do long before the grace is over."""
        self.attempts = [attempt for attempt in self.attempts if not attempt.ended]


@pytest.mark.parametrize("seed", range(30))
def test_publications_and_sweeps_in_any_order(world: World, seed: int) -> None:
    rng = random.Random(seed)
    ids = [factories.dataset(world.database, count=2, size=1).id for _ in range(2)]
    keeper, workers = world.keeper(), _Workers(world, world.store(), rng)
    for _ in range(40):
        world.proxy.heal()
        world.shower(rng, list(Kind), 3)
        match rng.choice(STEPS):
            case "claim":
                workers.claim()
            case "upload":
                workers.upload()
            case "finish":
                workers.finish()
            case "end":
                workers.end(workers.any(), rng.choice((FailureKind.STORE, FailureKind.IMAGE)))
            case _:
                workers.fence()
                with suppress(errors.StoreUnavailable, errors.StoreRefused):
                    keeper.sweep_objects()
                world.check()
    world.proxy.heal()
    if seed % 3 == 0:
        with world.database.transaction() as session:
            datasets.delete(session, ids[0])
    while workers.attempts or workers.claim():
        workers.end(workers.attempts.pop() if workers.attempts else None, FailureKind.IMAGE)
    keeper.sweep_objects()
    world.check()
    left = {entry.key for one in ids for entry in world.truth.list(keys.dataset_prefix(one))}
    assert left == {stored.key for stored in world.referenced()}


def _lose(world: World) -> UUID:
    """Return a dataset of two shards that failed and left whole attempts behind."""
    made = factories.dataset(world.database, count=2, size=1)
    workers = _Workers(world, world.truth, random.Random(1))
    while workers.claim():
        for _ in _NAMES:
            workers.upload()
        workers.end(workers.attempts.pop(), FailureKind.IMAGE)
    assert len(list(world.truth.list(keys.dataset_prefix(made.id)))) == 6
    return made.id


@pytest.mark.parametrize("fault", [Fault.LAGGING, Fault.REPEATING])
def test_a_listing_that_lies_makes_nobody_forget_an_orphan(world: World, fault: Fault) -> None:
    lost = _lose(world)
    world.proxy.script(Kind.LIST, fault)
    keeper = world.keeper()
    assert keeper.sweep_objects() == 6
    assert list(world.truth.list(keys.dataset_prefix(lost))) == []
    assert keeper.sweep_objects() == 0


def test_one_shards_trouble_is_not_the_others(world: World) -> None:
    lost = _lose(world)
    world.proxy.script(Kind.DELETE, Fault.FORBIDDEN)
    keeper = world.keeper()
    with pytest.raises(errors.StoreRefused):
        keeper.sweep_objects()
    assert len(list(world.truth.list(keys.dataset_prefix(lost)))) == 3
    assert keeper.sweep_objects() == 3
    assert list(world.truth.list(keys.dataset_prefix(lost))) == []


def test_a_store_that_is_away_is_left_alone_soon(world: World) -> None:
    for _ in range(3):
        _lose(world)
    world.proxy.seen.clear()
    world.proxy.always[Kind.LIST] = Fault.FORBIDDEN
    with pytest.raises(errors.StoreUnavailable):
        world.keeper().sweep_objects()
    assert len(world.proxy.seen) == TROUBLES_IN_A_ROW


def test_the_audit_finds_what_a_store_lost_or_spoilt(world: World) -> None:
    made = factories.dataset(world.database, count=1, size=1)
    slot = runners.runner(world.database, world.store(), world.folder)
    assert slot.run_next(None) is Outcome.PUBLISHED

    def damage(store: ObjectStore) -> list[tuple[Damage, str]]:
        source = DirectSource(world.database, store, made.id, world.folder / "assets")
        *_, report = audit(source)
        assert isinstance(report, AuditReport)
        wanted = (Damage.MISSING, Damage.WRONG_BYTES)  # the stand-in's labels are not the plan's
        return [(one.fault, one.subject) for one in report.findings if one.fault in wanted]

    samples, labels, _members = world.referenced()
    assert damage(world.truth) == []
    world.proxy.script(Kind.GET, Fault.FLIPPED)
    assert damage(world.store()) == []  # a network may fail where a store does not
    world.proxy.always[Kind.GET] = Fault.FLIPPED
    assert (Damage.WRONG_BYTES, samples.key) in damage(world.store())
    world.proxy.heal()
    world.proxy.spoil(f"{world.prefix}/{labels.key}", world.truth.get(labels.key))
    assert damage(world.truth) == [(Damage.WRONG_BYTES, labels.key)]
    world.truth.delete([labels.key])
    assert damage(world.truth) == [(Damage.MISSING, labels.key)]
