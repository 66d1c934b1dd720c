"""Audits of datasets: made one at a time on a thread of their own, the last few kept.

A request never waits for one: it gets what there is and asks again.
"""

from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event, Lock
from uuid import UUID

from hi5_common.domain.errors import TransientError
from hi5_common.fairness.report import Fairness

KEPT = 8
"""Audits of other datasets are forgotten, the one that was asked for longest ago first."""
MOST_WAITING = 16
"""Datasets whose audits are being made or wait to be; others must ask again later."""


class Stopped(TransientError):
    """The service is being stopped. Ask again when it is up."""


@dataclass(frozen=True)
class Delivered:
    """What a dataset had delivered: an audit holds as long as this does.

    Published shards never change, so two numbers say which ones there are.
    """

    shards: int
    images: int


@dataclass
class _Kept:
    """A dataset's last audit (or what went wrong with it), and the one that is being made."""

    made_of: Delivered | None = None
    made: Future[Fairness] | None = None
    making_of: Delivered | None = None
    making: Future[Fairness] | None = None


type Make = Callable[[UUID, Callable[[], None]], Fairness]
"""Audits a dataset; calls what it is given now and then, which raises Stopped to end it."""


class Audits:
    """One audit of a dataset however many ask for it."""

    def __init__(self, make: Make) -> None:
        self._make = make
        self._lock = Lock()
        self._kept: OrderedDict[UUID, _Kept] = OrderedDict()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="audit")
        self._stopped = Event()

    def of(
        self, dataset_id: UUID, delivered: Delivered, *, or_earlier: bool = False
    ) -> Fairness | None:
        """Return the audit of what is delivered; None while it is made, which this begins.

        or_earlier: one of what was delivered earlier will do, if there is one. Raises what the
        making raised: TransientError once, then it is made again; others until more is delivered.
        """
        with self._lock:
            kept = self._of(dataset_id)
            if kept.made_of != delivered and kept.making is None:
                self._begin(dataset_id, delivered, kept)
            found = kept.made if kept.made_of == delivered or or_earlier else None
            error = found and found.exception()
            if isinstance(error, TransientError):
                kept.made = kept.made_of = None
            elif error is not None and kept.made_of != delivered:
                found = None
        return None if found is None else found.result()

    def close(self) -> None:
        """End what is being made, at its next step, and wait for that."""
        self._stopped.set()
        self._thread.shutdown(cancel_futures=True)

    def _of(self, dataset_id: UUID) -> _Kept:
        kept = self._kept.setdefault(dataset_id, _Kept())
        self._kept.move_to_end(dataset_id)
        if kept.making is not None and kept.making.done():
            kept.made_of, kept.made = kept.making_of, kept.making
            kept.making = kept.making_of = None
        idle = [key for key, other in self._kept.items() if _is_idle(other) and other is not kept]
        for key in idle[: max(0, len(idle) + 1 - KEPT)]:
            del self._kept[key]
        return kept

    def _begin(self, dataset_id: UUID, delivered: Delivered, kept: _Kept) -> None:
        busy = sum(not _is_idle(other) for other in self._kept.values())
        if busy < MOST_WAITING:
            kept.making_of = delivered
            kept.making = self._thread.submit(self._make, dataset_id, self._go_on)

    def _go_on(self) -> None:
        if self._stopped.is_set():
            raise Stopped


def _is_idle(kept: _Kept) -> bool:
    return kept.making is None or kept.making.done()
