"""Plans of the specs asked about last: making one costs more than a request should."""

from collections import OrderedDict
from threading import Lock

from hi5_common.domain.errors import TransientError
from hi5_common.domain.plan import Plan
from hi5_common.domain.planning.order import WOVEN
from hi5_common.domain.spec import DatasetSpec

PLANS_KEPT = 16
IMAGES_KEPT = 2 * WOVEN
"""Of all plans kept. A plan takes up to 13 MB by default, for the images it weaves."""
MOST_WAITING = 16
"""Requests that may wait for their plans: each holds one of the threads that all others need."""


class TooManyPlans(TransientError):
    """Other plans are being made. Ask again in some seconds."""


class Plans:
    """A plan is a pure function of its spec, so it never goes stale.

    One is made at a time: together they would take no less time, and each its own memory.
    """

    def __init__(self) -> None:
        self.made = 0
        """How many plans were made, and not found here."""
        self._kept: OrderedDict[str, Plan] = OrderedDict()
        self._making, self._counting, self._waiting = Lock(), Lock(), 0

    def of(self, spec: DatasetSpec) -> Plan:
        """Return the plan of a spec. Raises TooManyPlans."""
        text = spec.canonical_json()
        return self._found(text) or self._in_turn(text)

    def _in_turn(self, text: str) -> Plan:
        with self._counting:
            if self._waiting >= MOST_WAITING:
                raise TooManyPlans
            self._waiting += 1
        try:
            with self._making:
                # Whoever was before us may have made the same.
                return self._found(text) or self._make(text)
        finally:
            with self._counting:
                self._waiting -= 1

    def _found(self, text: str) -> Plan | None:
        with self._counting:
            found = self._kept.get(text)
            if found is not None:
                self._kept.move_to_end(text)
            return found

    def _make(self, text: str) -> Plan:
        spec = DatasetSpec.model_validate_json(text)
        with self._counting:
            self._make_room(spec.count)
        plan = Plan.of(spec)
        with self._counting:
            self.made += 1
            self._kept[text] = plan
        return plan

    def _make_room(self, count: int) -> None:
        """Forget the plans asked for longest ago, before one of so many images takes memory."""
        images = min(count, WOVEN) + sum(min(plan.count, WOVEN) for plan in self._kept.values())
        while self._kept and (len(self._kept) >= PLANS_KEPT or images > IMAGES_KEPT):
            _, forgotten = self._kept.popitem(last=False)
            images -= min(forgotten.count, WOVEN)
