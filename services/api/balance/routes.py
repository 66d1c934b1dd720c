"""GET how balanced a dataset is."""

from uuid import UUID

from fastapi import APIRouter

from hi5_common.domain.balance import Balance
from services.api.contract import refused
from services.api.parts import Wired

router = APIRouter(prefix="/v1/datasets", tags=["balance"])


@router.get("/{dataset_id}/balance", responses=refused(404))
def get_balance(parts: Wired, dataset_id: UUID) -> Balance:
    """Compare requested, planned and delivered images, per value and per pair of values."""
    return parts.balances.of(dataset_id)
