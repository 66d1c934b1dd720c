"""GET whether the process lives, and whether what it needs answers."""

from fastapi import APIRouter, Response
from pydantic import BaseModel

from services.api.health import service
from services.api.health.service import PartState
from services.api.parts import Wired

router = APIRouter(tags=["health"])


class Alive(BaseModel):
    """The one thing that can be said."""

    status: str = "ok"


class Readiness(BaseModel):
    """`parts` says of the database, the store and the broker how each is."""

    ready: bool
    parts: dict[str, PartState]


@router.get("/healthz")
async def get_health() -> Alive:
    """Answer: the process lives."""
    return Alive()


@router.get("/readyz", responses={503: {"model": Readiness}})
async def get_readiness(parts: Wired, response: Response) -> Readiness:
    """Answer 200 if the database, the store and the broker answer, else 503."""
    states = await service.states(parts)
    ready = all(state.ok for state in states.values())
    response.status_code = 200 if ready else 503
    response.headers["Cache-Control"] = "no-store"
    return Readiness(ready=ready, parts=states)
