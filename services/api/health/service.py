"""Ask each part a small question, all at once, and wait only so long."""

import logging
from collections.abc import Callable

import anyio
from pydantic import BaseModel

from hi5_common.db.owned import OwnedDatasets
from hi5_common.domain.access import SERVICE
from hi5_common.domain.errors import Hi5Error
from hi5_common.storage.errors import ObjectMissing
from services.api.parts import Parts

log = logging.getLogger(__name__)

PATIENCE_S = 3.0
PROBE_KEY = "readiness-probe"


class PartState(BaseModel):
    """Whether a part answers; if not, what it said."""

    ok: bool
    detail: str


async def states(parts: Parts) -> dict[str, PartState]:
    """Return the state of every part, in at most PATIENCE_S seconds."""
    checks: dict[str, Callable[[Parts], str]] = {
        "database": _database,
        "store": _store,
        "broker": _broker,
    }
    found: dict[str, PartState] = {}

    async def ask(name: str) -> None:
        found[name] = await _state(checks[name], parts)

    async with anyio.create_task_group() as group:
        for name in checks:
            group.start_soon(ask, name)
    return {name: found[name] for name in checks}


async def _state(check: Callable[[Parts], str], parts: Parts) -> PartState:
    try:
        with anyio.fail_after(PATIENCE_S):
            detail = await anyio.to_thread.run_sync(check, parts, abandon_on_cancel=True)
    except TimeoutError:
        return PartState(ok=False, detail=f"no answer within {PATIENCE_S:g} s")
    except Hi5Error as error:
        log.warning("not ready: %s", error, extra={"action": "readiness"})
        return PartState(ok=False, detail=str(type(error).__doc__))
    return PartState(ok=True, detail=detail)


def _database(parts: Parts) -> str:
    with parts.database.snapshot() as session:
        OwnedDatasets(session, SERVICE).page(1, None)
    return "answers, and has its tables"


def _store(parts: Parts) -> str:
    try:
        parts.store.head(PROBE_KEY)
    except ObjectMissing:
        return "answers"
    return "answers"


def _broker(parts: Parts) -> str:
    return f"answers; {parts.doorbell.waiting()} messages wait"
