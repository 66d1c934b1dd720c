"""A `hi5 up` of our own for the length of a block, as a process of its own."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hi5_common.cli.stack import connection
from hi5_common.cli.stack.child import Child, ChildCommand, log_tail, python_module
from hi5_common.cli.stack.connection import Connection
from hi5_common.cli.stack.supervisor import POLL_S
from hi5_common.domain.errors import PermanentError, TransientError
from hi5_common.settings import RendererName


class StackEnded(PermanentError):
    """`hi5 up` ended before it was asked to."""

    def __init__(self, log: Path) -> None:
        super().__init__(f"`hi5 up` ended by itself. Its log {log} says:\n{log_tail(log, 20)}")


@contextmanager
def running_stack(data_dir: Path, *, workers: int, renderer: RendererName) -> Iterator[Connection]:
    """Start `hi5 up` in a folder, yield where it answers, and drain and end it after the block."""
    logs = data_dir / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    log = logs / "up.log"
    log.unlink(missing_ok=True)
    log.touch(mode=0o600)  # the link to sign in with is printed there
    arguments = python_module(
        "hi5_common.cli",
        "up",
        f"--data-dir={data_dir}",
        f"--workers={workers}",
        "--port=0",
        f"--renderer={renderer.value}",
    )
    child = Child.start(ChildCommand("up", arguments, 0), log, os.environ)
    try:
        yield _connection(child, data_dir)
    except TransientError as error:
        if child.exit_code() is not None:
            raise StackEnded(log) from error
        raise
    finally:
        child.ask_to_end()
        child.process.wait()


def _connection(child: Child, data_dir: Path) -> Connection:
    while child.exit_code() is None:
        if found := connection.find(data_dir):
            return found
        time.sleep(POLL_S)
    raise StackEnded(child.log)
