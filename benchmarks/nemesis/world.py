"""What is there when everything rests: rows, events, objects and what the objects hold."""

import hashlib
import io
import tarfile
from collections.abc import Mapping
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select

from hi5_common.db import datasets, events, shards
from hi5_common.db.engine import Database
from hi5_common.db.events import Event
from hi5_common.db.tables import DatasetRow
from hi5_common.domain import keys
from hi5_common.domain.records import Shard
from hi5_common.storage.port import ObjectStore

_ALL = 10_000_000


@dataclass(frozen=True)
class Kept:
    """An object as the store gives it out. members: the SHA-256 of each file of a tar, in order."""

    size_bytes: int
    sha256: str
    members: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class DatasetFacts:
    """A dataset's row and its delivery's."""

    id: UUID
    key: str | None
    seed: int
    count: int
    images_done: int


@dataclass(frozen=True)
class World:
    """Everything a checker may look at."""

    datasets: tuple[DatasetFacts, ...]
    shards: tuple[Shard, ...]
    events: tuple[Event, ...]
    """Of shards and datasets, in the order they happened to each dataset."""
    objects: Mapping[str, Kept]


def survey(database: Database, store: ObjectStore) -> World:
    """Read every row and every object there is."""
    with database.snapshot() as session:
        rows = session.execute(select(DatasetRow.id, DatasetRow.idempotency_key)).all()
        # Stored as owner/key.
        found = [
            (datasets.get(session, row.id), row.idempotency_key.partition("/")[2]) for row in rows
        ]
        facts = tuple(
            DatasetFacts(each.id, key, each.spec.seed, each.spec.count, each.images_done)
            for each, key in found
        )
        all_shards = tuple(
            shard for each in facts for shard in shards.of_dataset(session, each.id, _ALL)
        )
        history = tuple(
            event for each in facts for event in events.of_dataset(session, each.id, _ALL)
        )
    return World(facts, all_shards, history, kept_objects(store))


def kept_objects(store: ObjectStore) -> dict[str, Kept]:
    """Read every object of the store."""
    return {entry.key: _kept(store, entry.key) for entry in store.list("datasets")}


def _kept(store: ObjectStore, key: str) -> Kept:
    content = store.get(key)
    members = _members(content) if key.endswith(keys.SAMPLES) else ()
    return Kept(len(content), hashlib.sha256(content).hexdigest(), members)


def _members(content: bytes) -> tuple[tuple[str, str], ...]:
    try:
        with tarfile.open(fileobj=io.BytesIO(content)) as tar:
            return tuple((item.name, _sha256(tar, item)) for item in tar)
    except tarfile.TarError as error:  # wrong bytes: the checker says so
        return ((f"no tar: {error}", ""),)


def _sha256(tar: tarfile.TarFile, item: tarfile.TarInfo) -> str:
    file = tar.extractfile(item)
    return hashlib.sha256(b"" if file is None else file.read()).hexdigest()
