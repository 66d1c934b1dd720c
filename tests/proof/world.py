"""The surroundings of hi5's own code in a simulation: database, store, broker and render child."""

import json
import random
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from unittest.mock import patch
from uuid import UUID

import sqlalchemy
from sqlalchemy import event
from sqlalchemy.pool import StaticPool

from hi5_common.db import datasets, engine, shards, upkeep
from hi5_common.db.engine import Database, Session
from hi5_common.db.errors import DatabaseUnavailable
from hi5_common.domain import keys
from hi5_common.domain.records import Gap, Redraw, Tallies
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.vocabulary import Attribute
from hi5_common.queue.errors import BrokerUnavailable
from hi5_common.queue.port import Message, message
from hi5_common.storage.errors import ObjectMissing, StoreUnavailable
from hi5_common.storage.obstore_store import digest
from hi5_common.storage.port import Heed, ObjectEntry, ObjectHead, unheeding
from services.worker.fleet.attempt_errors import AttemptFailed, DrainRequested
from services.worker.fleet.pack import PackedFile, PackedShard
from tests.proof.faultpoints import Fault, Points
from tests.support.virtual_time import BEGINNING

NOTED = {
    shards: ("claim", "renew", "finish", "fail", "release", "cancel", "pending_to_ring"),
    upkeep: ("sweep_expired", "mark_swept", "forget_deleted"),
    datasets: ("create", "request_cancel", "retry_failed", "delete"),
}
"""The functions of which a transaction is named in the trace and at its points."""
LATE_S = 30.0


def memory_database() -> Database:
    """Return an SQLite database in memory, set up as hi5 sets up one in a file."""
    made = sqlalchemy.create_engine(
        "sqlite+pysqlite://", poolclass=StaticPool, connect_args={"check_same_thread": False}
    )
    event.listen(made, "connect", engine._prepare_sqlite)
    event.listen(made, "begin", engine._begin_sqlite)
    return Database(made)


@dataclass(frozen=True)
class SimulatedDatabase(Database):
    """hi5's database, away now and then, and with commits that fail or whose answer is lost."""

    points: Points
    doing: list[str] = field(default_factory=list)
    then: list[Callable[[], None]] = field(default_factory=list)
    """What to do once the transaction of now is committed: the history that is kept beside it."""

    @contextmanager
    def transaction(self) -> Iterator[Session]:
        """Yield a session; others go on before it and after it, never within it."""
        if self.points.reach("database.before", Fault.FAIL) is Fault.FAIL:
            raise DatabaseUnavailable("away")
        self.doing.clear()
        self.then.clear()
        with super().transaction() as session:
            yield session
            name = self.doing[0] if self.doing else "nothing"
            fault = self.points.draw(f"{name}.commit", Fault.CRASH, Fault.FAIL, Fault.UNHEARD)
            if fault is Fault.CRASH:
                self.points.scheduler.kill(self.points.scheduler.current.process)
            if fault is Fault.FAIL:
                raise DatabaseUnavailable("broke off before the commit")
        for act in self.then:
            act()
        if fault is Fault.UNHEARD:
            raise DatabaseUnavailable("broke off after the commit")
        self.points.scheduler.sleep(0.002)
        self.points.reach(f"{name}.committed")

    @contextmanager
    def snapshot(self) -> Iterator[Session]:
        if self.points.reach("snapshot.before", Fault.FAIL) is Fault.FAIL:
            raise DatabaseUnavailable("away")
        with super().snapshot() as session:
            yield session

    @contextmanager
    def noting(self) -> Iterator[None]:
        """Let hi5's functions tell which of them a transaction is for."""
        with ExitStack() as stack:
            for module, names in NOTED.items():
                for name in names:
                    known = self._noted(name, getattr(module, name))
                    stack.enter_context(patch.object(module, name, known))
            yield

    def _noted(self, name: str, act: Callable[..., Any]) -> Callable[..., Any]:
        def noted(*arguments: Any, **named: Any) -> Any:
            self.doing.append(name)
            answer = act(*arguments, **named)
            self.points.say(f"{name}{_told(arguments)} -> {str(answer)[:60]}")
            return answer

        return noted


def _told(arguments: Sequence[object]) -> str:
    return "".join(f" {str(argument)[:8]}" for argument in arguments[1:4])


def virtual_moment(now_s: Callable[[], float]) -> Callable[[Any], None]:
    """Return what makes SQLite's clock show the simulation's time."""

    def strftime(style: str, when: str, modifier: str) -> str:
        assert (style, when) == ("%Y-%m-%d %H:%M:%f", "now")
        moment = BEGINNING + timedelta(seconds=now_s() + float(modifier.split(maxsplit=1)[0]))
        return moment.replace(tzinfo=None).isoformat(" ", "milliseconds")

    def install(connection: sqlite3.Connection) -> None:
        connection.create_function("strftime", 3, strftime)

    return install


@dataclass
class SimulatedStore:
    """Objects in a dictionary, with every way to fail that a store has.

    forbidden: says of a key whether a row points to it; such an object is never to be deleted.
    """

    points: Points
    forbidden: Callable[[str], bool]
    objects: dict[str, bytes] = field(default_factory=dict)
    violations: list[str] = field(default_factory=list)

    def put(self, key: str, source: Path | bytes, sha256: str, heed: Heed = unheeding) -> None:
        data = source if isinstance(source, bytes) else source.read_bytes()
        assert digest(data) == sha256
        # Most often the fault that only reading back can find.
        faults = (Fault.FAIL, Fault.UNHEARD, Fault.LATE, Fault.CUT, Fault.CUT, Fault.CUT)
        fault = self.points.reach("put.before", *faults)
        self.points.scheduler.sleep(self.points.rng.uniform(0.01, 5.0))
        heed()
        if fault is Fault.LATE:
            self._land_later(key, data)
        elif fault is not Fault.FAIL:
            self.objects[key] = data[:-1] if fault is Fault.CUT else data
        self.points.reach("put.after")
        if fault in {Fault.FAIL, Fault.UNHEARD, Fault.LATE}:
            raise StoreUnavailable(f"{key}: {fault}")

    def stream(self, key: str) -> Iterator[bytes]:
        if self.points.reach("verify.before", Fault.FAIL) is Fault.FAIL:
            raise StoreUnavailable(key)
        yield self.get(key)
        self.points.reach("verify.after")

    def get(self, key: str) -> bytes:
        if key not in self.objects:
            raise ObjectMissing(key)
        return self.objects[key]

    def get_range(self, key: str, start: int, stop: int) -> bytes:
        return self.get(key)[start:stop]

    def head(self, key: str) -> ObjectHead:
        return ObjectHead(len(self.get(key)))

    def delete(self, keys: Sequence[str]) -> None:
        if not keys:
            return
        fault = self.points.reach("delete.before", Fault.FAIL, Fault.UNHEARD)
        for key in keys if fault is not Fault.FAIL else keys[: len(keys) // 2]:
            if self.forbidden(key):
                self.violations.append(f"{key} was deleted and a row points to it")
            self.objects.pop(key, None)
        self.points.scheduler.sleep(0.01)
        self.points.reach("delete.after")
        if fault is not None:
            raise StoreUnavailable(f"delete: {fault}")

    def list(self, prefix: str) -> Iterator[ObjectEntry]:
        if self.points.reach("list.before", Fault.FAIL) is Fault.FAIL:
            raise StoreUnavailable(prefix)
        found = [key for key in self.objects if key.startswith(f"{prefix}/")]
        self.points.scheduler.sleep(0.01)
        self.points.reach("list.after")
        for key in found:
            yield ObjectEntry(key, 0, datetime.now(UTC))

    def remove_unfinished(self, grace_s: float) -> int:
        return 0

    def _land_later(self, key: str, data: bytes) -> None:
        """Let a request arrive that its sender gave up. It is no thread of the sender."""
        scheduler = self.points.scheduler

        def land() -> None:
            scheduler.sleep(self.points.rng.uniform(0.1, LATE_S))
            self.objects[key] = data

        scheduler.start(type(scheduler.current.process)("network"), land)


@dataclass
class SimulatedDoorbell:
    """A broker that loses, doubles, delays and shuffles messages, and is away now and then."""

    points: Points
    messages: list[Message] = field(default_factory=list)

    def ring(self, shard_ids: Sequence[UUID]) -> None:
        fault = self.points.reach("ring.before", Fault.FAIL, Fault.UNHEARD, Fault.CUT)
        if fault is Fault.FAIL:
            raise BrokerUnavailable
        for shard_id in shard_ids[: len(shard_ids) // 2] if fault is Fault.CUT else shard_ids:
            twice = self.points.draw("message", Fault.DOUBLED) is Fault.DOUBLED
            self.messages += [message(shard_id)] * (1 + twice)
        self.points.reach("ring.after")
        if fault is Fault.UNHEARD:
            raise BrokerUnavailable

    def waiting(self) -> int:
        if self.points.reach("waiting.before", Fault.FAIL) is Fault.FAIL:
            raise BrokerUnavailable
        return len(self.messages)

    def take(self) -> Message | None:
        """Return any message, or none; what is taken by who then dies is lost."""
        if not self.messages:
            return None
        taken = self.messages.pop(self.points.rng.randrange(len(self.messages)))
        return None if self.points.draw("deliver", Fault.FAIL) else taken


@dataclass
class SimulatedRender:
    """A render child that takes time, fails, and says what it made; no pictures."""

    points: Points
    rng: random.Random
    indices: Sequence[int]
    check: Callable[[int], None]
    draining: Callable[[], bool]
    gaps: dict[int, Gap] = field(default_factory=dict)
    draws: dict[int, Redraw] = field(default_factory=dict)
    tries: dict[int, int] = field(default_factory=dict)

    def run(self) -> list[int]:
        """Return the images that were made."""
        self._fail_at("render.start", FailureKind.CHILD_START)
        done: list[int] = []
        for index in self.indices:
            self.points.scheduler.sleep(self.rng.uniform(0.5, 20.0))
            self.check(len(done))
            if self.draining():
                raise DrainRequested
            self._fail_at("render.image", FailureKind.WORKER)
            if self.points.draw("render.gap", Fault.FAIL):
                self.gaps[index] = Gap(index, "failed 3 times")
            else:
                done.append(index)
        if not done:
            raise AttemptFailed(FailureKind.IMAGE, "every image is a gap")
        self.points.reach("render.end")
        return sorted(done)

    def _fail_at(self, point: str, kind: FailureKind) -> None:
        if self.points.reach(point, Fault.FAIL) is Fault.FAIL:
            raise AttemptFailed(kind, point)


def cheap_pack(images: Sequence[int], folder: Path, crossed: Iterable[Attribute]) -> PackedShard:
    """Write three small files that say which images they hold: what `pack` does with pictures."""
    held = json.dumps(list(images))
    made = {}
    for name in (keys.SAMPLES, keys.LABELS, keys.MEMBERS):
        path = folder / name
        path.write_text(held, "utf-8")
        made[name] = PackedFile(name, path, digest(path))
    tallies = Tallies({f"image={index}": 1 for index in images}, {})
    return PackedShard(
        made[keys.SAMPLES], made[keys.LABELS], made[keys.MEMBERS], len(images), tallies
    )
