"""How often a process may die before something is wrong that a restart cannot mend."""

from collections import defaultdict, deque

MAX_DEATHS = 5
WINDOW_S = 60.0


class Restarts:
    """Remembers each process's deaths of the last WINDOW_S seconds."""

    def __init__(self) -> None:
        self._deaths_s: dict[str, deque[float]] = defaultdict(lambda: deque(maxlen=MAX_DEATHS))

    def allowed(self, name: str, now_s: float) -> bool:
        """Record a death at `now_s` and say whether to start the process again."""
        deaths_s = self._deaths_s[name]
        deaths_s.append(now_s)
        return len(deaths_s) < MAX_DEATHS or now_s - deaths_s[0] > WINDOW_S
