"""A whole API on a real socket, over SQLite, a folder and a doorbell in memory."""

import hashlib
import io
import json
import tarfile
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import Any
from uuid import UUID

import httpx
import uvicorn
from fastapi import FastAPI

from hi5_common.db import datasets, migrate, shards
from hi5_common.db.engine import open_database
from hi5_common.domain import keys, tallies
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import (
    Gap,
    Publication,
    Shard,
    ShardStatus,
    StoredObject,
    without_gaps,
)
from hi5_common.domain.retry import FailureKind
from hi5_common.export.label_table import write_label_table
from hi5_common.queue.memory import MemoryDoorbell
from hi5_common.settings import Settings
from hi5_common.storage.local import LocalFolder
from hi5_common.storage.port import ObjectStore
from services.api.main import assemble
from services.api.parts import Parts
from services.api.settings import ApiSettings
from tests.unit.export import factories

OWNER = "test-worker"
LEASE_S = 60.0
SPEC: Mapping[str, Any] = {
    "name": "test",
    "count": 12,
    "images_per_shard": 4,
    "image": {"width": 64, "height": 48},
}


@dataclass(frozen=True)
class World:
    """The API, a client of it, and everything behind it."""

    parts: Parts
    doorbell: MemoryDoorbell
    store: LocalFolder
    client: httpx.Client

    def submit(self, **changes: object) -> UUID:
        """Submit a dataset of 12 images in 3 shards and return its id."""
        answer = self.client.post("/v1/datasets", json={**SPEC, **changes})
        assert answer.status_code == 201, answer.text
        return UUID(answer.json()["id"])

    def rung(self, count: int) -> bool:
        """Say whether the doorbell rings `count` times: it does so after the answer is sent."""
        deadline = monotonic() + 10
        while len(self.doorbell.messages) < count and monotonic() < deadline:
            sleep(0.005)
        return len(self.doorbell.messages) == count

    def claim(self) -> Shard:
        """Take the oldest pending shard as a worker would."""
        with self.parts.database.transaction() as session:
            shard = shards.claim(session, None, OWNER, LEASE_S)
        assert shard is not None
        return shard

    def deliver(self, *gaps: int) -> Shard:
        """Render (after a fashion) and publish the oldest pending shard, but for some images."""
        shard = self.claim()
        with self.parts.database.snapshot() as session:
            plan = Plan.of(datasets.spec(session, shard.dataset_id))
        publication = publish(self.store, shard, plan, gaps)
        with self.parts.database.transaction() as session:
            shards.finish(session, shard.id, shard.attempt, OWNER, publication)
        return shard

    def fail(self, reason: str) -> Shard:
        """Claim a shard and have it fail for good."""
        shard = self.claim()
        with self.parts.database.transaction() as session:
            shards.fail(session, shard.id, shard.attempt, OWNER, FailureKind.IMAGE, reason)
            found = shards.get(session, shard.dataset_id, shard.number)
        assert found.status is ShardStatus.FAILED
        return found


def picture(index: int) -> bytes:
    """Return bytes that stand for image `index`; the API never looks into a picture."""
    return b"\xff\xd8\xff" + hashlib.sha256(str(index).encode()).digest() * (index + 1)


def label_of(plan: Plan, index: int) -> ImageLabel:
    """Return a label of image `index` with its true cell."""
    file_name = f"{index:09d}.jpg"
    return factories.label(index, file_name=file_name, attributes=plan.cell(index).as_dict())


def publish(
    store: ObjectStore, shard: Shard, plan: Plan, missing: Sequence[int] = ()
) -> Publication:
    """Put the three files of a shard where an attempt would put them."""
    gaps = tuple(Gap(index, "failed 5 times: <it broke>") for index in missing)
    labels = [label_of(plan, index) for index in without_gaps(shard.start, shard.stop, gaps)]
    tar, members = _tar({
        name: data
        for label in labels
        for name, data in (
            (f"{label.index:09d}.jpg", picture(label.index)),
            (f"{label.index:09d}.json", label.model_dump_json().encode()),
        )
    })  # fmt: skip
    prefix = keys.shard_prefix(shard.dataset_id, shard.number, shard.attempt)
    stored = [
        _put(store, f"{prefix}/{name}", data)
        for name, data in (
            (keys.SAMPLES, tar),
            (keys.LABELS, table(labels)),
            (keys.MEMBERS, members),
        )
    ]
    counted = tallies.tally((label.attributes for label in labels), plan.crossed)
    return Publication(stored[0], stored[1], stored[2], len(labels), counted, gaps)


def table(labels: Sequence[ImageLabel]) -> bytes:
    """Return labels as the bytes of a table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / keys.LABELS
        write_label_table(path, labels)
        return path.read_bytes()


def _tar(files: Mapping[str, bytes]) -> tuple[bytes, bytes]:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.USTAR_FORMAT) as tar:
        for name, data in files.items():
            header = tarfile.TarInfo(name)
            header.size = len(data)
            tar.addfile(header, io.BytesIO(data))
    # Read back by tarfile itself, so that the offsets are not ours.
    with tarfile.open(fileobj=io.BytesIO(buffer.getvalue())) as tar:
        members = [
            {
                "name": info.name,
                "offset": info.offset_data,
                "size": info.size,
                "sha256": hashlib.sha256(files[info.name]).hexdigest(),
            }
            for info in tar.getmembers()
        ]
    return buffer.getvalue(), json.dumps({"members": members}).encode()


def _put(store: ObjectStore, key: str, data: bytes) -> StoredObject:
    sha256 = hashlib.sha256(data).hexdigest()
    store.put(key, data, sha256)
    return StoredObject(key, len(data), sha256)


@contextmanager
def a_world(folder: Path, **api: int) -> Iterator[World]:
    """Start an API over an empty database and store in `folder`; stop it at the end.

    api: the API's own settings that are not as they come.
    """
    settings = Settings(data_dir=folder, database_url=f"sqlite:///{folder / 'hi5.sqlite'}")
    migrate.upgrade(settings.database_url)
    doorbell, store = MemoryDoorbell(), LocalFolder(folder / "store")
    database = open_database(settings.database_url)
    parts = Parts.of(settings, database, store, doorbell)
    try:
        app = assemble(parts, ApiSettings().model_copy(update=api))
        with serving(app) as url, httpx.Client(base_url=url, timeout=60) as client:
            yield World(parts, doorbell, store, client)
    finally:
        database.dispose()


@contextmanager
def serving(app: FastAPI) -> Iterator[str]:
    """Serve an app by uvicorn on a free port; yield its address."""
    config = uvicorn.Config(app, host="127.0.0.1", port=0, log_level="warning")
    server = uvicorn.Server(config)
    thread = Thread(target=server.run, daemon=True)
    thread.start()
    try:
        deadline = monotonic() + 30
        while not server.started and thread.is_alive() and monotonic() < deadline:
            sleep(0.005)
        assert server.started
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join(timeout=30)
