"""Audits of datasets: made one at a time on a thread of their own, the last few kept.

A request never waits for one: it gets what there is and asks again.
"""

from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event, Lock
from time import monotonic
from uuid import UUID

from hi5_common.domain.errors import TransientError
from hi5_common.fairness.report import Fairness

KEPT = 4
"""Audits of other datasets are forgotten, the one that was asked for longest ago first: not those
that nobody has fetched yet."""
MOST_WAITING = 16
"""Datasets whose audits wait to be made, are made, or wait to be fetched; others ask again."""
ABANDONED_S = 60.0
"""Who has not asked again for so long does not come to fetch an audit."""


class Stopped(TransientError):
    """The service is being stopped. Ask again when it is up."""


@dataclass(frozen=True)
class Settled:
    """What became of a dataset's shards: an audit holds as long as this does.

    shards, images: delivered; published shards never change, so the numbers say which ones there
    are. given_up: shards that failed or were cancelled. A retry makes them fewer.
    """

    shards: int
    images: int
    given_up: int = 0


@dataclass
class _Kept:
    """A dataset's last audit (or what went wrong with it), and the one that is being made."""

    made_of: Settled | None = None
    made: Future[Fairness] | None = None
    making_of: Settled | None = None
    making: Future[Fairness] | None = None
    asked_at: float = 0.0

    @property
    def is_empty(self) -> bool:
        return self.made is None and self.making is None

    def will_do(self, settled: Settled, *, or_earlier: bool) -> bool:
        """Tell whether the audit made is of this, or of what was settled a little earlier.

        One that calls images given up which are to come again will not do.
        """
        if self.made_of is None or self.made_of == settled:
            return self.made_of == settled
        return or_earlier and self.made_of.given_up <= settled.given_up


type Make = Callable[[UUID, Callable[[], None]], Fairness]
"""Audits a dataset; calls what it is given now and then, which raises Stopped to end it."""


class Audits:
    """One audit of a dataset however many ask for it."""

    def __init__(self, make: Make, clock: Callable[[], float] = monotonic) -> None:
        """clock: seconds since whenever."""
        self._make, self._clock = make, clock
        self._lock = Lock()
        self._kept: OrderedDict[UUID, _Kept] = OrderedDict()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="audit")
        self._stopped = Event()

    def of(
        self, dataset_id: UUID, settled: Settled, *, or_earlier: bool = False
    ) -> Fairness | None:
        """Return the audit of what is settled; None while it is made, which this begins.

        or_earlier: one of what was settled earlier will do, if there is one. Raises what the
        making raised: TransientError once, then it is made again; others until more is settled.
        """
        with self._lock:
            kept = self._of(dataset_id)
            if kept.made_of != settled and kept.making is None:
                self._begin(dataset_id, settled, kept)
            found = kept.made if kept.will_do(settled, or_earlier=or_earlier) else None
            error = found and found.exception()
            if isinstance(error, TransientError):
                kept.made = kept.made_of = None
            elif error is not None and kept.made_of != settled:
                found = None
        return None if found is None else found.result()

    def close(self) -> None:
        """End what is being made, at its next step, and wait for that."""
        self._stopped.set()
        self._thread.shutdown(cancel_futures=True)

    def _of(self, dataset_id: UUID) -> _Kept:
        kept = self._kept.setdefault(dataset_id, _Kept())
        self._kept.move_to_end(dataset_id)
        kept.asked_at = self._clock()
        if kept.making is not None and kept.making.done():
            kept.made_of, kept.made = kept.making_of, kept.making
            kept.making = kept.making_of = None
        self._forget_others(kept)
        return kept

    def _forget_others(self, kept: _Kept) -> None:
        others = [(key, other) for key, other in self._kept.items() if other is not kept]
        idle = [key for key, other in others if not other.is_empty and not self._is_awaited(other)]
        empty = [key for key, other in others if other.is_empty]
        for key in empty + idle[: max(0, len(idle) + 1 - KEPT)]:
            del self._kept[key]

    def _begin(self, dataset_id: UUID, settled: Settled, kept: _Kept) -> None:
        awaited = sum(self._is_awaited(other) for other in self._kept.values())
        if awaited < MOST_WAITING:
            kept.making_of = settled
            kept.making = self._thread.submit(self._make, dataset_id, self._go_on)

    def _is_awaited(self, kept: _Kept) -> bool:
        """Tell whether an audit is being made, or made and still to be fetched by who asked."""
        if kept.making is None:
            return False
        return not kept.making.done() or self._clock() - kept.asked_at < ABANDONED_S

    def _go_on(self) -> None:
        if self._stopped.is_set():
            raise Stopped
