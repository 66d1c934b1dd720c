"""Requests to stop, counted: the first drains, the second kills."""

import signal
from types import FrameType, TracebackType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequests:
    """Counts SIGINT, SIGTERM and SIGHUP for the length of a block."""

    def __init__(self) -> None:
        self._count = 0
        self._before: dict[signal.Signals, signal.Handlers] = {}

    def asked(self) -> bool:
        return self._count > 0

    def repeated(self) -> bool:
        return self._count > 1

    def __enter__(self) -> Self:
        for number in _SIGNALS:
            self._before[number] = signal.signal(number, self._hear)  # type: ignore[assignment]
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _hear(self, _signal: int, _frame: FrameType | None) -> None:
        self._count += 1
