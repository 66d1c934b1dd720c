"""One root for every error that hi5 raises, split by whether trying again can help."""

from collections.abc import Sequence
from dataclasses import dataclass


class Hi5Error(Exception):
    """Something in hi5 went wrong."""

    def __init__(self, message: str | None = None) -> None:
        super().__init__(message or self.__class__.__doc__)


class TransientError(Hi5Error):
    """The same call may succeed later."""


class PermanentError(Hi5Error):
    """Trying again cannot help."""


@dataclass(frozen=True)
class Problem:
    """One thing wrong with what a user sent: where, what, and how to mend it."""

    field: str
    value: object
    remedy: str

    def __str__(self) -> str:
        return f"{self.field}: {_shown(self.value)} is not valid. {self.remedy}"


class InvalidInput(PermanentError):
    """What was asked for cannot be done as written."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 120 else text[:117] + "..."
