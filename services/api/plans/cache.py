"""Plans of the specs asked about last: making one costs more than a request should."""

import functools

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec

PLANS_KEPT = 16
"""Each takes up to 13 MB by default: a million images woven, of six attributes."""


class Plans:
    """A plan is a pure function of its spec, so it never goes stale."""

    def __init__(self) -> None:
        self._plan = functools.lru_cache(maxsize=PLANS_KEPT)(_plan)

    @property
    def made(self) -> int:
        """Return how many plans were made, and not found here."""
        return self._plan.cache_info().misses

    def of(self, spec: DatasetSpec) -> Plan:
        """Return the plan of a spec."""
        return self._plan(spec.canonical_json())


def _plan(canonical_json: str) -> Plan:
    return Plan.of(DatasetSpec.model_validate_json(canonical_json))
