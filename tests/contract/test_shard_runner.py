"""One attempt from claim to publication, on SQLite and on Postgres, with a stand-in child."""

import json
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from uuid import UUID

import pytest

from hi5_common.db import datasets, deliveries, events, shards
from hi5_common.db.engine import Database
from hi5_common.db.errors import DatabaseUnavailable
from hi5_common.domain.records import DatasetStatus, Shard, ShardStatus
from hi5_common.storage.errors import StoreUnavailable
from hi5_common.storage.open import memory_store
from hi5_common.storage.port import Heed, ObjectEntry, ObjectHead, ObjectStore, unheeding
from hi5_common.storage.publish import verify
from services.worker.fleet.shard_runner import Outcome
from tests.support import factories
from tests.support.runners import runner


@dataclass
class Store:
    """A store that lets a test step in before it stores anything."""

    inner: ObjectStore = field(default_factory=memory_store)
    broken: bool = False
    spoil: bool = False
    before_put: threading.Event | None = None
    put_begins: threading.Event = field(default_factory=threading.Event)

    def put(self, key: str, source: Path | bytes, sha256: str, heed: Heed = unheeding) -> None:
        if self.broken:
            raise StoreUnavailable("the disk is full")
        self.put_begins.set()
        if self.before_put is not None:
            assert self.before_put.wait(60)
        self.inner.put(key, source, sha256, heed)

    def get(self, key: str) -> bytes:
        return self.inner.get(key)

    def get_range(self, key: str, start: int, stop: int) -> bytes:
        return self.inner.get_range(key, start, stop)

    def head(self, key: str) -> ObjectHead:
        return self.inner.head(key)

    def stream(self, key: str) -> Iterator[bytes]:
        yield from self.inner.stream(key)
        yield b"!" * self.spoil

    def delete(self, keys: Sequence[str]) -> None:
        self.inner.delete(keys)

    def list(self, prefix: str) -> Iterator[ObjectEntry]:
        return self.inner.list(prefix)

    def remove_unfinished(self, grace_s: float) -> int:
        return self.inner.remove_unfinished(grace_s)


def all_shards(database: Database, dataset_id: UUID) -> list[Shard]:
    with database.snapshot() as session:
        return shards.of_dataset(session, dataset_id, 100)


def only_shard(database: Database, dataset_id: UUID) -> Shard:
    (shard,) = all_shards(database, dataset_id)
    return shard


def test_a_slot_works_until_nothing_is_due(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=5, size=2)
    store = Store()
    slot = runner(database, store, tmp_path)
    assert slot.run_while_due(None, most=10) == [Outcome.PUBLISHED] * 3
    with database.snapshot() as session:
        seen = datasets.get(session, made.id)
        counted = deliveries.tallies(session, made.id)
    assert (seen.status, seen.images_done) == (DatasetStatus.COMPLETE, 5)
    assert counted.values["pose=rocker"] == 5
    for shard in all_shards(database, made.id):
        assert shard.publication
        for stored in (
            shard.publication.samples,
            shard.publication.labels,
            shard.publication.members,
        ):
            verify(store, stored)
    assert not list((tmp_path / "scratch").glob("hi5-attempt-*"))


def test_members_lead_into_the_published_tar(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2, size=2)
    store = Store()
    runner(database, store, tmp_path).run_next(None)
    publication = only_shard(database, made.id).publication
    assert publication
    members = json.loads(store.get(publication.members.key))["members"]
    found = {m["name"]: (m["offset"], m["offset"] + m["size"]) for m in members}
    assert store.get_range(publication.samples.key, *found["000000001.jpg"]) == b"picture 0 1"


def test_nothing_due_is_no_work(database: Database, tmp_path: Path) -> None:
    assert runner(database, Store(), tmp_path).run_next(UUID(int=3)) is None


def test_a_poisoned_image_is_a_named_gap(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2, size=2, name="crash_always 1")
    assert runner(database, Store(), tmp_path).run_next(None) is Outcome.PUBLISHED
    publication = only_shard(database, made.id).publication
    assert publication
    (gap,) = publication.gaps
    assert (publication.image_count, gap.index) == (1, 1)
    assert gap.reason.startswith("crash: failed 5 times; killed by SIGSEGV")
    with database.snapshot() as session:
        seen = datasets.get(session, made.id)
        history = events.of_dataset(session, made.id, 100)
    assert (seen.status, seen.images_done) == (DatasetStatus.COMPLETE_WITH_GAPS, 1)
    assert seen.images_missing == 1
    assert any(
        "image 1 is missing: crash: failed 5 times" in str(event.detail) for event in history
    )


def test_an_image_that_cannot_be_made_is_drawn_again_and_the_row_says_so(
    database: Database, tmp_path: Path
) -> None:
    made = factories.dataset(database, count=2, size=2, name="crash_first_draw 1")
    assert runner(database, Store(), tmp_path).run_next(None) is Outcome.PUBLISHED
    publication = only_shard(database, made.id).publication
    assert publication
    assert [(one.index, one.draw) for one in publication.redraws] == [(1, 1)]
    with database.snapshot() as session:
        assert datasets.get(session, made.id).status is DatasetStatus.COMPLETE


def test_a_poisoned_shard_fails_with_its_image(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=1, size=1, name="crash_always 0")
    assert runner(database, Store(), tmp_path).run_next(None) is Outcome.FAILED
    shard = only_shard(database, made.id)
    assert shard.status is ShardStatus.FAILED
    assert "image 0: crash: failed 5 times; killed by SIGSEGV" in str(shard.failure_reason)


@pytest.mark.parametrize(
    ("store", "reason"),
    [
        (Store(broken=True), "store: the disk is full"),
        (Store(spoil=True), "wrong_bytes: "),
    ],
    ids=["broken", "spoilt"],
)
def test_a_store_in_trouble_costs_an_attempt(
    database: Database, tmp_path: Path, store: Store, reason: str
) -> None:
    made = factories.dataset(database, count=2, size=2)
    assert runner(database, store, tmp_path).run_next(None) is Outcome.FAILED
    shard = only_shard(database, made.id)
    assert shard.status is ShardStatus.PENDING
    assert str(shard.failure_reason).startswith(reason)


@pytest.mark.parametrize("fault", ["no_disk", "full_for_tar"])
def test_a_full_disk_costs_an_attempt_and_is_named(
    database: Database, tmp_path: Path, fault: str
) -> None:
    """While an image is written, and while the shard is packed."""
    made = factories.dataset(database, count=2, size=2, name=f"{fault} 1")
    slot = runner(database, Store(), tmp_path)
    assert slot.run_next(None) is Outcome.FAILED
    shard = only_shard(database, made.id)
    assert shard.status is ShardStatus.PENDING
    assert str(shard.failure_reason).startswith("disk_full: ")
    assert not list((tmp_path / "scratch").glob("hi5-attempt-*"))
    written = json.loads(slot.ledger.path.read_text("utf-8"))
    assert written["ends"] == ({"disk_full": 1} if fault == "no_disk" else {"done": 1})


def test_a_worker_that_is_not_admitted_claims_nothing(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2, size=2)
    slot = runner(database, Store(), tmp_path)
    assert replace(slot, admitted=lambda: False).run_while_due(None, most=5) == []
    shard = only_shard(database, made.id)
    assert (shard.status, shard.attempt) == (ShardStatus.PENDING, 0)
    assert slot.run_while_due(None, most=5) == [Outcome.PUBLISHED]


def test_a_zombies_publication_is_refused(database: Database, tmp_path: Path) -> None:
    """Two attempts overlap: the first one wakes up when the second has published."""
    made = factories.dataset(database, count=2, size=2)
    store = Store(before_put=threading.Event())
    outcomes: list[Outcome | None] = []
    zombie = threading.Thread(
        target=lambda: outcomes.append(
            runner(database, store, tmp_path / "a", owner="zombie").run_next(None)
        )
    )
    zombie.start()
    assert store.put_begins.wait(60)
    hand_over(database, only_shard(database, made.id))
    other = runner(database, store.inner, tmp_path / "b", owner="other")
    assert other.run_next(None) is Outcome.PUBLISHED
    published = only_shard(database, made.id)
    assert store.before_put
    store.before_put.set()
    zombie.join()
    assert outcomes == [Outcome.LOST]
    assert only_shard(database, made.id) == published
    assert published.attempt == 2


def test_a_cancelled_dataset_stops_its_child(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2, size=2, name="wait 1")
    slot = runner(database, Store(), tmp_path)
    outcomes: list[Outcome | None] = []
    thread = threading.Thread(target=lambda: outcomes.append(slot.run_next(None)))
    thread.start()
    while only_shard(database, made.id).status is not ShardStatus.LEASED:
        thread.join(0.05)
    with database.transaction() as session:
        datasets.request_cancel(session, made.id)
    thread.join()
    assert outcomes == [Outcome.CANCELLED]
    assert only_shard(database, made.id).status is ShardStatus.CANCELLED


def test_a_draining_slot_hands_its_shard_back(database: Database, tmp_path: Path) -> None:
    made = factories.dataset(database, count=2, size=2, name="wait 1")
    drained = threading.Event()
    slot = replace(runner(database, Store(), tmp_path), draining=drained.is_set)
    drain = threading.Timer(1.0, drained.set)
    drain.start()
    slow = replace(slot, settings=slot.settings.model_copy(update={"drain_s": 0.0}))
    assert slow.run_while_due(None, most=5) == [Outcome.RELEASED]
    shard = only_shard(database, made.id)
    assert (shard.status, shard.failure_reason) == (ShardStatus.PENDING, None)


def test_a_commit_whose_answer_is_lost_is_sent_again(
    database: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = factories.dataset(database, count=2, size=2)
    finish, calls = shards.finish, []

    def lose_the_first_answer(*arguments: object) -> None:
        finish(*arguments)  # type: ignore[arg-type]
        calls.append(arguments)
        if len(calls) == 1:
            arguments[0].commit()  # type: ignore[attr-defined]
            raise DatabaseUnavailable

    monkeypatch.setattr(shards, "finish", lose_the_first_answer)
    assert runner(database, Store(), tmp_path).run_next(None) is Outcome.PUBLISHED
    assert len(calls) == 2
    assert only_shard(database, made.id).status is ShardStatus.DONE


def hand_over(database: Database, shard: Shard) -> None:
    """Let the lease end as if its owner had been silent for too long."""
    with database.transaction() as session:
        assert shard.lease_owner
        shards.release(session, shard.id, shard.attempt, shard.lease_owner)
