"""Whether a worker may claim: only after its canary has passed, once for all of its processes."""

import fcntl
import json
import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hi5_common.domain.errors import PermanentError, TransientError
from services.worker.fleet.attempt_errors import AttemptFailed, DrainRequested

log = logging.getLogger(__name__)

FIRST_PAUSE_S = 10.0
LONGEST_PAUSE_S = 600.0

_PASSED, _REFUSED, _LOCK = "canary-passed", "canary-refused.json", "canary.lock"


class CanaryDied(PermanentError):
    """The machine's picture or label of the known scene is not what it has to be."""


@dataclass(frozen=True)
class Admission:
    """Says whether this worker may claim. folder: what the processes of one worker share.

    fly renders and judges; it raises CanaryDied, AttemptFailed, TransientError (of a store that is
    unfit) or OSError if this worker may not claim, and DrainRequested if it is told to stop.
    """

    folder: Path
    fly: Callable[[], None]

    def __call__(self) -> bool:
        """Return whether the canary has passed; let it fly if that is due.

        One process of the worker does, others wait for it. A pause after a failure is not waited
        for: the answer is no until it is over.
        """
        if self._passed.exists():
            return True
        self.folder.mkdir(exist_ok=True)  # somebody may have tidied the temporary folder
        with _alone(self.folder / _LOCK):
            return self._passed.exists() or (self._due() and self._flown())

    @property
    def _passed(self) -> Path:
        return self.folder / _PASSED

    def _due(self) -> bool:
        refused = _refusal(self.folder)
        return refused is None or time.time() >= refused["not_before"]

    def _flown(self) -> bool:
        began_s = time.monotonic()
        try:
            self.fly()
        except DrainRequested:
            return False
        except (AttemptFailed, CanaryDied, TransientError, OSError) as error:
            self._refuse(str(error))
            return False
        self._passed.touch()
        (self.folder / _REFUSED).unlink(missing_ok=True)
        took_s = time.monotonic() - began_s
        log.info("canary passed in %.1f s", took_s, extra={"action": "canary_passed"})
        return True

    def _refuse(self, reason: str) -> None:
        refused = _refusal(self.folder)
        failures = 1 if refused is None else refused["failures"] + 1
        pause_s = min(FIRST_PAUSE_S * 2.0 ** (failures - 1), LONGEST_PAUSE_S)
        log.error(
            "this worker claims nothing: its canary failed, the next one is in %.0f s: %s",
            pause_s,
            reason,
            extra={"action": "canary_failed", "failures": failures},
        )
        document = {"reason": reason, "failures": failures, "not_before": time.time() + pause_s}
        partial = self.folder / f"{_REFUSED}.partial"
        partial.write_text(json.dumps(document), encoding="utf-8")
        partial.replace(self.folder / _REFUSED)


def refusal(folder: Path | None) -> str | None:
    """Return why the worker of a folder claims nothing as its canary failed; None if it may."""
    refused = None if folder is None else _refusal(folder)
    return None if refused is None else f"its canary failed: {refused['reason']}"


def _refusal(folder: Path) -> dict[str, Any] | None:
    try:
        document: dict[str, Any] = json.loads((folder / _REFUSED).read_text("utf-8"))
    except FileNotFoundError:
        return None
    return document


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Hold a lock that dies with the process."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
