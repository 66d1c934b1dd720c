"""A keeper that neglects duties: NEMESIS_BROKEN names which (broken_worker.py)."""

import os

from services.worker import keeper
from tests.nemesis.broken import LEASE_SWEEPER, OBJECT_SWEEPER, VARIABLE

_DUTIES = {LEASE_SWEEPER: "sweep_leases", OBJECT_SWEEPER: "sweep_objects"}


def main() -> int:
    """Keep house but for that."""
    for name in os.environ[VARIABLE].split():
        if name in _DUTIES:
            setattr(keeper.Keeper, _DUTIES[name], lambda _: 0)
    return keeper.main([])


if __name__ == "__main__":
    raise SystemExit(main())
