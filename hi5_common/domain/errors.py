"""One root for every error that hi5 raises, split by whether trying again can help."""

import reprlib
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
        return f"{self.field}: {shown(self.value)} is not valid. {self.remedy}"


class InvalidInput(PermanentError):
    """What was asked for cannot be done as written."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class _Short(reprlib.Repr):
    """Bounded in depth and length: a few YAML references can stand for terabytes."""

    def repr_int(self, number: int, _level: int) -> str:
        # Python refuses to write numbers of thousands of digits.
        return repr(number) if number.bit_length() < 200 else f"<{number.bit_length()}-bit number>"


_short = _Short(maxlevel=3, maxdict=8, maxlist=8, maxtuple=8, maxset=8, maxstring=120, maxother=120)


def shown(value: object, limit: int = 120) -> str:
    """Return the repr of anything a user sent, in at most `limit` characters."""
    text = _short.repr(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."
