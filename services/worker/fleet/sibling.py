"""A process beside the worker's main one, kept alive by a thread that does nothing else.

Not by the event loop: it stands still while the broker is away, which is when the poller counts.
"""

import logging
import os
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field

log = logging.getLogger(__name__)

SHORT_LIFE_S = 10.0
LONGEST_PAUSE_S = 30.0


@dataclass
class Sibling:
    """Runs `python -m module OUR_PID`, and again whenever it ends, until told to stop.

    The process must die with us by itself (PR_SET_PDEATHSIG): its parent is a thread that lives
    as long as we do.
    """

    module: str
    _stop: threading.Event = field(default_factory=threading.Event)
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _process: "subprocess.Popen[bytes] | None" = None
    _thread: threading.Thread | None = None

    def start(self) -> None:
        """Start it, from a thread of its own."""
        self._thread = threading.Thread(target=self._keep, name=self.module, daemon=True)
        self._thread.start()

    def ask_to_end(self) -> None:
        """Send SIGTERM, and start it no more."""
        with self._lock:
            self._stop.set()
            if self._process is not None:
                self._process.terminate()

    def kill(self) -> None:
        """Send SIGKILL, and start it no more."""
        with self._lock:
            self._stop.set()
            if self._process is not None:
                self._process.kill()

    def join(self) -> None:
        """Wait until it has ended. Call ask_to_end or kill before."""
        if self._thread is not None:
            self._thread.join()

    def _keep(self) -> None:
        pause_s = 1.0
        while True:
            with self._lock:
                if self._stop.is_set():
                    return
                started_s = time.monotonic()
                command = [sys.executable, "-m", self.module, str(os.getpid())]
                self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
            code = self._process.wait()
            if self._stop.is_set():
                return
            lived_long = time.monotonic() - started_s > SHORT_LIFE_S
            pause_s = 1.0 if lived_long else min(2 * pause_s, LONGEST_PAUSE_S)
            level = logging.INFO if code == 0 else logging.WARNING
            log.log(level, "%s ended with %d", self.module, code, extra={"action": "sibling_ended"})
            self._stop.wait(pause_s)
