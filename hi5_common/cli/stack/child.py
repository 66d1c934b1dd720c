"""One process of `hi5 up`: its command, its log, and its end."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from hi5_common.cli.stack import leash

_PYTHON_PATH = "PYTHONPATH"


@dataclass(frozen=True)
class ChildCommand:
    """What to run. `stop_rank` orders the end: all of rank 0 have ended before rank 1 is asked."""

    name: str
    arguments: tuple[str, ...]
    stop_rank: int


@dataclass(frozen=True, eq=False)
class Child:
    """A running child on its leash, in a session of its own: Ctrl-C reaches only `hi5 up`."""

    command: ChildCommand
    log: Path
    process: subprocess.Popen[bytes]

    @classmethod
    def start(cls, command: ChildCommand, log: Path, environment: Mapping[str, str]) -> Self:
        """Start the command with its output appended to the log."""
        arguments = [sys.executable, "-I", leash.__file__, str(os.getpid()), *command.arguments]
        with log.open("ab") as output:
            process = subprocess.Popen(
                arguments,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                env=importing_us(environment),
            )
        return cls(command, log, process)

    def exit_code(self) -> int | None:
        """Return None while it runs."""
        return self.process.poll()

    def ask_to_end(self) -> None:
        """Send SIGTERM through the leash, which kills what has not ended in time."""
        if self.exit_code() is None:
            self.process.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Kill leash and command; `hi5 up` adopts and kills what they leave."""
        if self.exit_code() is None:
            self.process.kill()

    def log_tail(self, lines: int = 15) -> str:
        """Return the end of the log, for a message."""
        return log_tail(self.log, lines)


def python_module(module: str, *arguments: str) -> tuple[str, ...]:
    """Return the arguments that run a module with this Python."""
    return sys.executable, "-m", module, *arguments


def importing_us(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with the folder of hi5's packages importable, installed or not."""
    import hi5_common

    root = str(Path(hi5_common.__path__[0]).parent)
    rest = environment.get(_PYTHON_PATH)
    return {**environment, _PYTHON_PATH: f"{root}{os.pathsep}{rest}" if rest else root}


def log_tail(log: Path, lines: int) -> str:
    """Return the last lines of a log file."""
    text = log.read_text("utf-8", errors="replace") if log.exists() else ""
    return "\n".join(_last(text.splitlines(), lines))


def _last(items: Sequence[str], count: int) -> Sequence[str]:
    return items[-count:]
