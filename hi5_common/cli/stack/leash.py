"""Run one command so that nothing of it outlives us: python leash.py PARENT_PID COMMAND…

A process of its own between `hi5 up` and each child, because only a parent can collect what a
child leaves behind. It adopts the orphans below it (PR_SET_CHILD_SUBREAPER) and is told when
`hi5 up` itself dies, even by SIGKILL (PR_SET_PDEATHSIG). Then, or at SIGTERM, the command gets
SIGTERM and GRACE_S to end; whatever remains afterwards is killed. Only the standard library, so
that it starts in a few milliseconds with `python -I`.
"""

import contextlib
import ctypes
import os
import signal
import sys
import threading
from pathlib import Path
from types import FrameType

GRACE_S = 90.0
"""What a render worker may take to finish its image, as in docker-compose.yml."""

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36


def prctl(option: int, value: int) -> None:
    """Set a property of this process. Raises OSError if the kernel refuses."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(option, value, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl")


def adopt_orphans() -> None:
    """Become the parent of every descendant whose own parent dies."""
    prctl(_PR_SET_CHILD_SUBREAPER, 1)


def kill_children() -> None:
    """Kill all children, and the orphans that become ours while we do, until none is left."""
    while children := _children():
        for pid in children:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            os.wait()


def main(arguments: list[str]) -> int:
    """Run the command; return its exit code, or 128 plus the signal that ended it."""
    parent, command = int(arguments[0]), arguments[1:]
    adopt_orphans()
    signals = {signal.SIGTERM, signal.SIGINT, signal.SIGHUP}
    signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    pid = _start(command)
    _end_on_signal(pid)
    prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, signals)
    if os.getppid() != parent:
        signal.raise_signal(signal.SIGTERM)
    code = _wait(pid)
    kill_children()
    return code


def _start(command: list[str]) -> int:
    pid = os.fork()
    if pid:
        return pid
    prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    try:
        os.execvp(command[0], command)  # noqa: S606 (an argument list, no shell)
    except OSError as error:
        os.write(2, f"{command[0]}: {error.strerror}\n".encode())
    os._exit(127)


def _end_on_signal(pid: int) -> None:
    def end(_signal: int, _frame: FrameType | None) -> None:
        os.kill(pid, signal.SIGTERM)
        late = threading.Timer(GRACE_S, os.kill, (pid, signal.SIGKILL))
        late.daemon = True
        late.start()

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, end)


def _wait(pid: int) -> int:
    """Collect orphans until the command itself ends."""
    while True:
        ended, status = os.wait()
        if ended == pid:
            code = os.waitstatus_to_exitcode(status)
            return code if code >= 0 else 128 - code


def _children() -> list[int]:
    """Every child of every thread of ours."""
    found = [tasks.read_text() for tasks in Path("/proc/self/task").glob("*/children")]
    return [int(pid) for pid in " ".join(found).split()]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
