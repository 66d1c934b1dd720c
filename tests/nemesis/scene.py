"""A few images, a few processes, and the nemesis's own checker at the end."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from uuid import UUID

from sqlalchemy import func, select

from benchmarks.nemesis.checker import Verdict, check
from benchmarks.nemesis.history import History
from benchmarks.nemesis.processes import Fleet, Process
from benchmarks.nemesis.servers import Servers, Site
from benchmarks.nemesis.users import Shape
from benchmarks.nemesis.world import survey
from hi5_common.db import clock, datasets, shards, upkeep
from hi5_common.db.engine import Database, open_database
from hi5_common.db.tables import ShardRow
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import Shard, ShardStatus
from hi5_common.domain.spec import parse_spec
from hi5_common.storage.open import open_store
from hi5_common.storage.port import ObjectStore
from tests.nemesis.broken import STOPPED_BEFORE_FINISH, VARIABLE

SHAPE = Shape(shards=1, images_per_shard=4, image_s=0.4)
OBJECTS_OF_A_SHARD = 3
LONG_SINCE_S = 3.0
PATIENCE_S = 240.0


SceneOf = Callable[..., "Scene"]


@dataclass
class Scene:
    """One dataset of one shard, and a fleet whose processes a test starts itself."""

    servers: Servers
    site: Site
    fleet: Fleet
    history: History
    database: Database
    store: ObjectStore
    dataset_id: UUID = field(init=False)

    def __post_init__(self) -> None:
        self.history.append("submit", key="scene", seed=1)
        spec = parse_spec(SHAPE.spec(1))
        with self.database.transaction() as session:
            made = datasets.create(session, spec, Plan.of(spec), idempotency_key="scene")
        self.dataset_id = made.dataset.id
        self.history.append("acknowledged", key="scene", seed=1, dataset_id=self.dataset_id)

    def shard(self) -> Shard:
        with self.database.snapshot() as session:
            return shards.get(session, self.dataset_id, 0)

    def wait_for(self, condition: Callable[[], bool]) -> None:
        """Wait for something to become true; fail with the logs if it never does."""
        give_up_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < give_up_s, self.logs()
            time.sleep(0.1)

    def wait_for_stop(self) -> int:
        """Wait until a pool process has stopped before it publishes; return its id."""
        note = self.site.folder / STOPPED_BEFORE_FINISH
        self.wait_for(lambda: note.exists() and bool(note.read_text("utf-8")))
        return int(note.read_text("utf-8"))

    def wait_for_publication(self) -> None:
        self.wait_for(lambda: self.shard().status is ShardStatus.DONE)

    def wait_for_log(self, process: Process, text: str) -> None:
        self.wait_for(lambda: text in process.log_path.read_text("utf-8", "replace"))

    def is_overdue(self) -> bool:
        """Return whether its lease ran out some sweeps ago."""
        overdue = select(func.count()).where(
            ShardRow.status == ShardStatus.LEASED.value,
            ShardRow.lease_until < clock.now_plus(-LONG_SINCE_S),
        )
        with self.database.snapshot() as session:
            return bool(session.scalar(overdue))

    def is_to_be_swept(self) -> bool:
        """Return whether a keeper would have objects to remove."""
        with self.database.snapshot() as session:
            return bool(upkeep.attempts_to_sweep(session, self.site.ours.orphan_grace_s))

    def objects(self) -> int:
        return sum(1 for _ in self.store.list("datasets"))

    def logs(self) -> str:
        return "\n".join(
            f"== {path.name}\n{path.read_text('utf-8', 'replace')[-3000:]}"
            for path in sorted(self.site.folder.glob("*.log"))
        )

    def verdict(self) -> Verdict:
        """Stop everything and check."""
        self.fleet.end()
        world = survey(self.database, self.store)
        return check(self.history.entries(), world, self.site.template)


@contextmanager
def scene(servers: Servers, folder: Path, broken: tuple[str, ...]) -> Iterator[Scene]:
    """Set a scene; kill its processes at the end."""
    site = servers.site(folder, orphan_grace_s=1, sweep_s=0.5)
    fleet = Fleet(
        site.theirs,
        folder,
        port=0,
        worker_count=2,
        worker_app="tests.nemesis.broken_worker",
        keeper_module="tests.nemesis.broken_keeper",
        variables={VARIABLE: " ".join(broken)},
    )
    database = open_database(site.ours.database_url)
    history = History(folder / "history.jsonl")
    try:
        yield Scene(servers, site, fleet, history, database, open_store(site.ours))
    finally:
        fleet.end()
        database.dispose()
