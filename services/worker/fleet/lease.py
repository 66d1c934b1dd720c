"""Holding a lease: renewed from a thread, given up before it can run out."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from hi5_common.db import errors, shards
from hi5_common.db.engine import Database
from hi5_common.domain.errors import TransientError
from hi5_common.domain.records import Shard
from hi5_common.settings import Settings
from services.worker.fleet.attempt_errors import CancelRequested, DrainRequested, LeaseGone

log = logging.getLogger(__name__)

PACKING_S = 10.0
"""A worker told to stop goes on so much longer than `drain_s` to pack and upload what is done."""


class Lease:
    """The right to work on a shard, as far as this process can know.

    A renewal proves that this process lives; that it makes progress is the image time-out's
    business. `held_since_s` is time.monotonic() from before the claim was sent. `draining` says
    whether the worker is told to stop.
    """

    def __init__(
        self,
        database: Database,
        shard: Shard,
        owner: str,
        settings: Settings,
        held_since_s: float,
        draining: Callable[[], bool] = lambda: False,
    ) -> None:
        self._database = database
        self._shard = shard
        self._owner = owner
        self._settings = settings
        self._renewed_s = held_since_s
        self._draining = draining
        self._drain_since_s: float | None = None
        self._progress = 0
        self._lost = False
        self._cancel_requested = False
        self._stop = threading.Event()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Renew as long as the block runs."""
        thread = threading.Thread(target=self._keep, name="lease", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._stop.set()
            thread.join()

    def check(self, progress: int) -> None:
        """Raise LeaseGone or CancelRequested if the work has become pointless.

        Raises DrainRequested when a worker that is told to stop has used up its time.
        """
        self._progress = progress
        age_s = time.monotonic() - self._renewed_s
        if self._lost or age_s > self._settings.lease_s - self._settings.fence_margin_s:
            raise LeaseGone
        if self._cancel_requested:
            raise CancelRequested
        if self._draining():
            now_s = time.monotonic()
            self._drain_since_s = now_s if self._drain_since_s is None else self._drain_since_s
            if now_s - self._drain_since_s > self._settings.drain_s + PACKING_S:
                raise DrainRequested

    def _keep(self) -> None:
        pause_s = self._settings.renew_s
        while not self._stop.wait(pause_s) and not self._lost:
            pause_s = self._settings.renew_s if self._renew() else min(1.0, pause_s)

    def _renew(self) -> bool:
        sent_s = time.monotonic()
        try:
            with self._database.transaction() as session:
                answer = shards.renew(
                    session,
                    self._shard.id,
                    self._shard.attempt,
                    self._owner,
                    self._settings.lease_s,
                    self._progress,
                )
        except errors.LeaseLost:
            self._lost = True
            return False
        except (TransientError, errors.DatabaseOutdated) as error:  # away, or being migrated
            log.warning("lease not renewed: %s", error, extra={"action": "renew_failed"})
            return False
        self._renewed_s = sent_s
        self._cancel_requested = answer.cancel_requested
        return True
