"""GET the machines that render; let a blocked one claim again."""

from typing import Annotated

from fastapi import APIRouter, Path

from hi5_common.db import workers
from hi5_common.domain.workers import Worker, WorkerList
from services.api.access.doors import Administering
from services.api.contract import refused

router = APIRouter(prefix="/v1/workers", tags=["workers"])

Name = Annotated[str, Path(pattern=r"^[A-Za-z0-9_.-]{1,80}$")]


@router.get("")
def list_workers(access: Administering) -> WorkerList:
    """List the machines seen within a week: who is alive, what it does, who is blocked and why."""
    with access.parts.database.snapshot() as session:
        return WorkerList(items=workers.all_of_them(session))


@router.post("/{name}/unblock", responses=refused(404))
def unblock_worker(access: Administering, name: Name) -> Worker:
    """Let a machine claim again, and forget what failed there. Idempotent."""
    with access.parts.database.transaction() as session:
        return workers.unblock(session, name)
