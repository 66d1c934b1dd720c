"""Threads of which one runs at a time, on a clock that jumps to whatever comes next.

Which of several that could go on does so is drawn from a seeded generator: the same seed gives the
same run. A thread gives way only where it asks for time, so what lies between is one step.
"""

import random
import threading
from collections.abc import Callable
from dataclasses import dataclass, field


class Killed(BaseException):
    """The process of this thread was killed: nothing after this line happened."""


@dataclass
class Process:
    """A process of the simulation: killed, or stopped and continued, with all its threads."""

    name: str
    alive: bool = True
    stopped_until_s: float = 0.0


@dataclass(eq=False)
class Task:
    """A thread of a process; wake_s is when it wants to go on."""

    process: Process
    wake_s: float
    turn: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    done: bool = False

    def due_s(self) -> float:
        """Return when it goes on: a thread of a killed process ends at once."""
        return max(self.wake_s, self.process.stopped_until_s) if self.process.alive else 0.0


class Scheduler:
    """Decides which thread goes on. The thread that makes it is its first, of process "user"."""

    def __init__(self, rng: random.Random) -> None:
        self.now_s = 0.0
        self.failures: list[BaseException] = []
        self._rng = rng
        self.current = Task(Process("user"), 0.0)
        self._tasks = [self.current]

    def start(self, process: Process, act: Callable[[], None]) -> Task:
        """Run something in a new thread of a process, from the next time somebody gives way."""
        task = Task(process, self.now_s)
        thread = threading.Thread(target=self._live, args=(task, act), daemon=True)
        self._tasks.append(task)
        thread.start()
        return task

    def sleep(self, seconds: float) -> None:
        """Give way until so much time has passed. Raises Killed in a process that was killed."""
        task = self.current
        task.wake_s = self.now_s + seconds
        self._hand_over(task)
        if not task.process.alive:
            raise Killed

    def kill(self, process: Process) -> None:
        """Kill a process; its threads unwind before anything else happens."""
        process.alive = False
        if self.current.process is process:
            raise Killed

    def end(self) -> None:
        """Kill everything but the first thread and wait until it is gone."""
        for task in self._tasks:
            task.process.alive = task is self._tasks[0]
        while len(self._tasks) > 1:
            self.sleep(0.0)

    def _live(self, task: Task, act: Callable[[], None]) -> None:
        task.turn.acquire()
        self.current = task
        try:
            if task.process.alive:
                act()
        except Killed:
            pass
        except BaseException as error:  # noqa: BLE001 whatever it is, the run has failed
            self.failures.append(error)
        task.done = True
        self._tasks.remove(task)
        self._next().turn.release()

    def _hand_over(self, task: Task) -> None:
        following = self._next()
        if following is not task:
            following.turn.release()
            task.turn.acquire()
        self.current = task

    def _next(self) -> Task:
        first_s = min(task.due_s() for task in self._tasks)
        self.now_s = max(self.now_s, first_s)
        ready = [task for task in self._tasks if task.due_s() <= self.now_s]
        dying = [task for task in ready if not task.process.alive]
        return dying[0] if dying else self._rng.choice(ready)


@dataclass
class Event:
    """What threading.Event is, for threads of a scheduler."""

    scheduler: Scheduler
    _set: bool = False
    _waiting: list[Task] = field(default_factory=list)

    def is_set(self) -> bool:
        return self._set

    def set(self) -> None:
        self._set = True
        for task in self._waiting:
            task.wake_s = self.scheduler.now_s
        self._waiting.clear()

    def wait(self, timeout_s: float) -> bool:
        if not self._set:
            self._waiting.append(self.scheduler.current)
            self.scheduler.sleep(timeout_s)
        return self._set


@dataclass
class Thread:
    """What threading.Thread is, for threads of a scheduler."""

    scheduler: Scheduler
    target: Callable[[], None]
    task: Task | None = None

    def start(self) -> None:
        self.task = self.scheduler.start(self.scheduler.current.process, self.target)

    def join(self) -> None:
        # A thread of a killed process waits for nobody.
        while self.task is not None and not self.task.done and self.task.process.alive:
            self.scheduler.sleep(0.01)  # no less: time has to pass for what the other waits for


@dataclass(frozen=True)
class Time:
    """What the module `time` is, as far as hi5 asks it anything."""

    scheduler: Scheduler

    def monotonic(self) -> float:
        return self.scheduler.now_s

    def sleep(self, seconds: float) -> None:
        self.scheduler.sleep(seconds)


@dataclass(frozen=True)
class Threading:
    """What the module `threading` is, as far as a lease asks it anything."""

    scheduler: Scheduler

    def Event(self) -> Event:  # noqa: N802 the module's own name
        return Event(self.scheduler)

    def Thread(self, target: Callable[[], None], name: str, daemon: bool) -> Thread:  # noqa: N802 the module's own names
        return Thread(self.scheduler, target)
