"""A worker's own look for work, on SQLite and on Postgres, in one process."""

import logging
import os
import threading
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from hi5_common.db import shards, workers
from hi5_common.db.engine import Database, open_database
from hi5_common.domain.retry import FailureKind
from services.worker import healthcheck
from services.worker.fleet.drain import Bell
from services.worker.fleet.heartbeat import Heartbeat
from services.worker.fleet.poller import MOST_ATTEMPTS, SILENT_RINGS, Poller
from services.worker.fleet.slots import Slots
from tests.support import factories
from tests.support.runners import settings


@dataclass
class Work:
    """What a slot does: it waits until it is let go."""

    go: threading.Event = field(default_factory=threading.Event)
    begun: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))

    def __call__(self) -> int:
        self.begun.release()
        assert self.go.wait(60)
        return MOST_ATTEMPTS


def poller(database: Database, folder: Path, work: Work, draining: threading.Event) -> Poller:
    own = settings(folder, worker_slots=2, idle_poll_s=0.1, worker_name="node")
    return Poller(
        database=database,
        settings=own,
        slots=Slots(folder / "shared", own.worker_slots),
        bell=Bell(folder / "shared" / "rung"),
        heartbeat=Heartbeat(own.health_dir, "worker"),
        draining=draining.is_set,
        run_slot=work,
    )


def test_every_free_slot_works_and_no_more(database: Database, tmp_path: Path) -> None:
    factories.dataset(database)
    work = Work()
    own = poller(database, tmp_path, work, threading.Event())
    busy = own.slots.take()
    assert busy  # as a process of the pool would hold it
    assert own.look() == 1
    assert own.look() == 0
    busy.free()
    assert own.look() == 1
    work.go.set()
    own.join()
    assert own.attempts == 2 * MOST_ATTEMPTS
    assert own.slots.take() is not None


def test_nothing_due_takes_no_slot_and_is_a_sign_of_life(
    database: Database, tmp_path: Path
) -> None:
    own = poller(database, tmp_path, Work(), threading.Event())
    assert own.heartbeat.problem() is not None
    assert own.look() == 0
    assert own.heartbeat.problem() is None
    with database.snapshot() as session:
        (worker,) = workers.all_of_them(session)
    assert (worker.name, worker.alive, worker.slots) == ("node", True, 2)


def test_slots_that_are_free_again_at_once_are_not_taken_again(
    database: Database, tmp_path: Path
) -> None:
    factories.dataset(database)
    work = Work()
    work.go.set()
    own = poller(database, tmp_path, work, threading.Event())
    own.slots = Slots(None, 2)  # every one is always free
    assert own.look() == 2
    own.join()
    assert own.attempts == 2 * MOST_ATTEMPTS


def test_a_database_that_is_away_is_no_sign_of_life(tmp_path: Path) -> None:
    away = open_database(f"sqlite:///{tmp_path}")  # a folder
    own = poller(away, tmp_path, Work(), threading.Event())
    assert own.look() == 0
    assert own.heartbeat.problem() is not None


def test_it_ends_for_a_fresh_process_and_when_told(database: Database, tmp_path: Path) -> None:
    factories.dataset(database)
    work, draining = Work(), threading.Event()
    work.go.set()
    own = poller(database, tmp_path, work, draining)
    own.run()  # returns: it has made MOST_ATTEMPTS
    assert own.attempts >= MOST_ATTEMPTS
    draining.set()
    poller(database, tmp_path, Work(), draining).run()


def test_a_blocked_machine_takes_nothing_and_its_health_says_why(
    database: Database,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    made = factories.dataset(database, count=20)
    own = poller(database, tmp_path, Work(), threading.Event())
    monkeypatch.setenv("HI5_DATA_DIR", str(tmp_path))
    own.ask()
    assert healthcheck.main(["worker"]) == 0
    assert "hears no doorbell" in capsys.readouterr().out
    with database.transaction() as session:
        for shard in shards.of_dataset(session, made.id, 3):
            workers.failed(session, "node", shard.id, FailureKind.WORKER, "no GPU", 600)
    assert own.look() == 0
    assert healthcheck.main(["worker"]) == 1
    assert "3 different shards failed here" in capsys.readouterr().err
    with database.transaction() as session:
        workers.unblock(session, "node")
    own.ask()
    assert healthcheck.main(["worker"]) == 0


def test_silence_of_the_broker_is_said_once(
    database: Database, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    factories.dataset(database)
    work = Work()
    work.go.set()
    own = poller(database, tmp_path, work, threading.Event())

    def warnings() -> int:
        return sum("no doorbell has rung" in each.message for each in caplog.records)

    with caplog.at_level(logging.WARNING):
        own.bell.note()
        own.look()
        own.join()
        assert warnings() == 0
        assert own.bell.path
        long_ago_s = own.bell.path.stat().st_mtime - SILENT_RINGS * own.settings.ring_s - 1
        os.utime(own.bell.path, (long_ago_s, long_ago_s))
        for _ in range(3):
            own.look()
            own.join()
        assert warnings() == 1
