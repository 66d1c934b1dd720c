"""One line of `hi5 doctor`."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class CheckResult:
    """What was looked at, how it is, and what to do when it is not in order."""

    name: str
    ok: bool
    found: str
    remedy: str = ""


@dataclass(frozen=True)
class Check:
    """Something to look at. `look` returns what it found and raises CheckFailed otherwise."""

    name: str
    look: Callable[[], str]
    remedy: str

    def run(self) -> CheckResult:
        """Look, and never raise: a doctor sees every patient."""
        try:
            return CheckResult(self.name, True, self.look())
        except Exception as error:  # noqa: BLE001 (whatever is wrong is the finding)
            found = str(error) or type(error).__name__
            return CheckResult(self.name, False, found.splitlines()[0], self.remedy)


class CheckFailed(Exception):
    """What was looked at is not in order."""
