"""POST a spec to see its plan; nothing is stored and nothing rendered."""

from fastapi import APIRouter

from services.api.access.doors import Reading
from services.api.cards.places import require_tradable
from services.api.contract import refused
from services.api.plans.schemas import PlanView
from services.api.spec_body import OPENAPI_BODY, SpecBody

router = APIRouter(prefix="/v1/plans", tags=["plans"])


@router.post("", openapi_extra=OPENAPI_BODY, responses=refused(415))
def make_plan(access: Reading, spec: SpecBody) -> PlanView:
    """Return exact counts, shards, evenness of the joint cells, and the first images' cells."""
    require_tradable(access.parts, spec)
    return PlanView.of(access.parts.plans.of(spec))
