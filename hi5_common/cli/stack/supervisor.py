"""Keeps the processes of `hi5 up` running, and ends them in order."""

import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from hi5_common.cli.stack.child import Child, ChildCommand
from hi5_common.cli.stack.restarts import Restarts
from hi5_common.domain.errors import PermanentError

POLL_S = 0.2

type Tell = Callable[[str], None]


class ProcessKeepsDying(PermanentError):
    """A process of hi5 dies again and again."""

    def __init__(self, child: Child, code: int) -> None:
        super().__init__(
            f"{child.command.name} keeps ending (exit code {code}); its log is {child.log}:\n"
            f"{child.log_tail()}"
        )


class Supervisor:
    """The children of one `hi5 up`. Not for several threads: PDEATHSIG follows the thread."""

    def __init__(self, logs: Path, environment: Mapping[str, str], tell: Tell) -> None:
        self._logs = logs
        self._environment = environment
        self._tell = tell
        self._children: list[Child] = []
        self._restarts = Restarts()

    def start(self, command: ChildCommand) -> None:
        """Start a child that is kept running from now on."""
        log = self._logs / f"{command.name}.log"
        self._children.append(Child.start(command, log, self._environment))

    def revive_the_dead(self) -> None:
        """Start again what has ended. Raises ProcessKeepsDying when that does not help."""
        for child in tuple(self._children):
            code = child.exit_code()
            if code is not None:
                self._revive(child, code)

    def end(self, killed: Callable[[], bool]) -> None:
        """End everything, rank by rank, and at once when `killed()` becomes true."""
        for rank in sorted({child.command.stop_rank for child in self._children}):
            group = [child for child in self._children if child.command.stop_rank == rank]
            for child in group:
                child.ask_to_end()
            _wait_for(group, killed)
        self._children.clear()

    def _revive(self, child: Child, code: int) -> None:
        self._children.remove(child)
        if not self._restarts.allowed(child.command.name, time.monotonic()):
            raise ProcessKeepsDying(child, code)
        self._tell(f"{child.command.name} ended (exit code {code}); starting it again")
        self.start(child.command)


def _wait_for(group: Iterable[Child], killed: Callable[[], bool]) -> None:
    while running := [child for child in group if child.exit_code() is None]:
        if killed():
            for child in running:
                child.kill()
        time.sleep(POLL_S)
