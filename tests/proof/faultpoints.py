"""Named places where a process may die, stop, be refused or not hear the answer."""

import random
from collections import Counter
from dataclasses import dataclass, field
from enum import StrEnum

from tests.proof.scheduler import Scheduler


class Fault(StrEnum):
    """What may happen at a point."""

    CRASH = "crash"
    """The process is killed here."""
    STOP = "stop"
    """The process stands still, with every thread, and goes on later: perhaps as a zombie."""
    FAIL = "fail"
    """What is asked for does not happen, and an error says so."""
    UNHEARD = "unheard"
    """It happens, and an error says that it does not."""
    LATE = "late"
    """An error says that it does not happen, and then it does."""
    CUT = "cut"
    """A part of it happens, and all is said to be well."""
    DOUBLED = "doubled"


EVERYWHERE = (Fault.CRASH, Fault.STOP)
STOPS_S = (5.0, 30.0, 70.0, 200.0)
USER, KEEPER = "user", "keeper"
COLLECTING_S = 250.0
"""For so much longer keepers are struck."""


@dataclass
class Points:
    """Draws what happens at each point, until `calm_s`; keeps what happened for the trace."""

    scheduler: Scheduler
    rng: random.Random
    chance: float
    calm_s: float
    reached: Counter[str] = field(default_factory=Counter)
    struck: Counter[str] = field(default_factory=Counter)
    trace: list[str] = field(default_factory=list)

    def reach(self, point: str, *possible: Fault) -> Fault | None:
        """Return what is to happen here, None as a rule. A crash or a stop happens at once."""
        fault = self.draw(point, *EVERYWHERE, *possible)
        process = self.scheduler.current.process
        if fault is Fault.CRASH:
            self.scheduler.kill(process)
        if fault is Fault.STOP:
            process.stopped_until_s = self.scheduler.now_s + self.rng.choice(STOPS_S)
            self.scheduler.sleep(0.0)
            return None
        return fault

    def draw(self, point: str, *possible: Fault) -> Fault | None:
        """Return what is to happen here, None as a rule; never to a user."""
        self.reached[point] += 1
        process = self.scheduler.current.process
        # What there is to collect has to grow old first.
        calm_s = self.calm_s + (COLLECTING_S if process.name.startswith(KEEPER) else 0.0)
        calm = self.scheduler.now_s >= calm_s or process.name == USER
        if calm or not possible or self.rng.random() >= self.chance:
            return None
        fault = self.rng.choice(possible)
        self.struck[f"{point}:{fault.value}"] += 1
        self.say(f"{point}: {fault.value}")
        return fault

    def say(self, what: str) -> None:
        """Add a line to the trace."""
        name = self.scheduler.current.process.name
        self.trace.append(f"{self.scheduler.now_s:9.3f} {name:>10} {what}")
