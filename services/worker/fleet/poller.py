"""The worker's own look for work: `python -m services.worker.fleet.poller PARENT_PID`.

A sibling of the pool's processes that asks the database now and then, so that a worker goes on
while the broker is away, empty or half-open. It takes a slot as they do, and so never has more
shards going than the worker is to have. It ends, and hands back what it has, when the worker's
main process is told to stop or dies.
"""

import ctypes
import logging
import secrets
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from types import FrameType

from hi5_common.db import shards, workers
from hi5_common.db.engine import Database, open_database
from hi5_common.domain.errors import Hi5Error
from hi5_common.logs import configure_logging
from hi5_common.settings import Settings
from services.worker.fleet import admission, drain
from services.worker.fleet.drain import Bell, DrainFlag
from services.worker.fleet.heartbeat import Heartbeat
from services.worker.fleet.slots import Slot, Slots

log = logging.getLogger(__name__)

MOST_ATTEMPTS = 100
"""After so many the process makes room for a fresh one, as those of Celery's pool do."""
JITTER = 0.25
"""A pause is up to so much shorter or longer, or the workers of a fleet would ask all at once."""
GLANCE_S = 0.5
"""How often a pause looks whether the worker is told to stop."""
SILENT_RINGS = 4
"""So many times `ring_s` without a doorbell, though work was waiting, are a sign of trouble."""
_PR_SET_PDEATHSIG = 1


@dataclass
class Poller:
    """Takes free slots of a worker whenever the database has work for them.

    run_slot works in a held slot until nothing is due, and returns how many attempts it made.
    """

    database: Database
    settings: Settings
    slots: Slots
    bell: Bell
    heartbeat: Heartbeat
    draining: Callable[[], bool]
    run_slot: Callable[[], int]
    attempts: int = 0
    warned: bool = False
    _threads: list[threading.Thread] = field(default_factory=list)
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _started_s: float = field(default_factory=time.monotonic)

    def run(self) -> None:
        """Look for work until told to stop, or until it is time for a fresh process."""
        pauses = secrets.SystemRandom()
        self.ask()  # a sign of life; the work itself is left to the doorbells for now
        while not self.draining():
            self._wait(self.settings.idle_poll_s * pauses.uniform(1 - JITTER, 1 + JITTER))
            self._threads = [thread for thread in self._threads if thread.is_alive()]
            if self.attempts >= MOST_ATTEMPTS and not self._threads:
                break
            if not self.draining() and self.attempts < MOST_ATTEMPTS:
                self.look()
        self.join()
        self.heartbeat.end()

    def ask(self) -> bool:
        """Return whether the database has work for us. An answer is the worker's sign of life."""
        settings = self.settings
        try:
            with self.database.transaction() as session:
                blocked = workers.seen(session, settings.worker_name, settings.worker_slots)
                due = blocked is None and shards.any_due(session)
        except Hi5Error as error:
            log.warning("no look for work: %s", error, extra={"action": "poll_failed"})
            return False
        refused = blocked or admission.refusal(self.slots.folder)
        self.heartbeat.beat(refused and f"it claims nothing for a while: {refused}")
        return due

    def look(self) -> int:
        """Ask once, and put every free slot to work if there is any; return how many.

        Never more than there are: one that is free again at once is not taken a second time.
        """
        most = self.slots.count if self.ask() else 0
        taken = 0
        while taken < most and (slot := self.slots.take()) is not None:
            taken += 1
            # A render child dies with the thread that started it: one for as long as the work.
            thread = threading.Thread(target=self._work, args=(slot,), name="slot")
            self._threads.append(thread)
            thread.start()
        if taken:
            log.info("found work by asking", extra={"action": "poll", "slots": taken})
            self._suspect_the_broker()
        return taken

    def join(self) -> None:
        """Wait until no slot of ours works any more."""
        for thread in self._threads:
            thread.join()

    def _work(self, slot: Slot) -> None:
        try:
            attempts = self.run_slot()
        except Hi5Error as error:
            log.warning("no work taken: %s", error, extra={"action": "claim_failed"})
            return
        finally:
            slot.free()
        with self._lock:
            self.attempts += attempts

    def _suspect_the_broker(self) -> None:
        age_s = self.bell.age_s()
        silence_s = time.monotonic() - self._started_s if age_s is None else age_s
        silent = silence_s > SILENT_RINGS * self.settings.ring_s
        if silent and not self.warned:
            log.warning(
                "work was waiting and no doorbell has rung for %.0f s: see to the broker and the"
                " keeper. This worker goes on without them",
                silence_s,
                extra={"action": "no_doorbell"},
            )
        self.warned = silent

    def _wait(self, pause_s: float) -> None:
        until_s = time.monotonic() + pause_s
        while (left_s := until_s - time.monotonic()) > 0 and not self.draining():
            time.sleep(min(GLANCE_S, left_s))


def main(arguments: list[str]) -> int:
    """Look for work as long as the worker whose process id is given lives."""
    parent_pid = int(arguments[0])
    stop = threading.Event()

    def end(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    settings = Settings()
    configure_logging(settings.log_format)
    folder = drain.folder_of_this_process()
    flag = DrainFlag(folder and folder / "drain", parent_pid)
    _run(settings, lambda: stop.is_set() or flag())
    if flag.orphaned() and folder is not None:
        shutil.rmtree(folder, ignore_errors=True)  # nobody else is left to do it
    return 0


def _run(settings: Settings, draining: Callable[[], bool]) -> None:
    database = open_database(settings.resolved_database_url)
    poller = Poller(
        database=database,
        settings=settings,
        slots=Slots(drain.folder_of_this_process(), settings.worker_slots),
        bell=drain.bell_of_this_process(),
        heartbeat=Heartbeat(settings.health_dir, "worker"),
        draining=draining,
        run_slot=lambda: _run_slot(settings, draining),
    )
    poller.run()
    database.dispose()


def _run_slot(settings: Settings, draining: Callable[[], bool]) -> int:
    # Imported when there is work: a fleet whose broker works has a light process here.
    from services.worker.fleet.opening import open_runner

    runner = open_runner(settings, draining)
    try:
        return len(runner.run_while_due(None, MOST_ATTEMPTS))
    finally:
        runner.database.dispose()


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
