"""Errors in words, and the exit codes that scripts can rely on."""

import os
import sys
from enum import IntEnum

import pydantic
from pydantic_core import ErrorDetails
from rich.markup import escape

from hi5_common.cli import console
from hi5_common.domain.errors import Hi5Error, InvalidInput, Problem, TransientError
from hi5_common.settings import PREFIX, Settings


class ExitCode(IntEnum):
    """0 is success; OUTCOME says the command ran and what it looked at is not in order."""

    OUTCOME = 1
    USAGE = 2
    UNREACHABLE = 3


class ServiceUnreachable(TransientError):
    """No hi5 service answers."""

    def __init__(self, url: str, reason: str) -> None:
        super().__init__(
            f"No hi5 service answers at {url} ({reason}). "
            "Start one with `hi5 up`, or name another with --url or HI5_URL."
        )


class OutcomeError(Hi5Error):
    """The command ran; what it worked on failed."""


def report(error: Hi5Error) -> int:
    """Print an error to standard error and return the exit code that belongs to it."""
    if isinstance(error, InvalidInput):
        for problem in error.problems:
            _print_problem(problem)
        return ExitCode.USAGE
    console.err.print(f"[red]error[/]: {escape(str(error))}")
    if isinstance(error, TransientError):
        return ExitCode.UNREACHABLE
    return ExitCode.OUTCOME if isinstance(error, OutcomeError) else ExitCode.USAGE


def wrong_settings(error: pydantic.ValidationError) -> InvalidInput:
    """Translate what is wrong with an HI5_* variable; anything else is a fault of ours."""
    if error.title != Settings.__name__:
        raise error
    return InvalidInput([_wrong_setting(detail) for detail in error.errors(include_url=False)])


def wrong_file(error: OSError) -> InvalidInput:
    """Translate what the system says of a file or folder; anything else is a fault of ours."""
    if error.filename is None:
        raise error
    reason = error.strerror or type(error).__name__
    return InvalidInput([Problem("file", str(error.filename), f"{reason}: name another.")])


def quiet_pipe() -> int:
    """Keep Python from complaining about a closed pipe at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _wrong_setting(detail: ErrorDetails) -> Problem:
    names = [f"{PREFIX}{str(part).upper()}" for part in detail["loc"]]
    value = detail["input"] if names else None
    said = detail["msg"].removeprefix("Value error, ")
    return Problem(".".join(names) or "settings", value, f"{said}.")


def _print_problem(problem: Problem) -> None:
    console.err.print(f"[red]error[/]: [bold]{escape(problem.field)}[/]: {_shown(problem.value)}")
    console.err.print(f"       {escape(problem.remedy)}")


def _shown(value: object) -> str:
    text = value if isinstance(value, str) else repr(value)
    return escape(text if len(text) <= 300 else f"{text[:297]}...")
