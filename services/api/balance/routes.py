"""GET how balanced a dataset is."""

from uuid import UUID

from fastapi import APIRouter

from hi5_common.domain.balance import Balance
from services.api.access.doors import Reading
from services.api.contract import refused

router = APIRouter(prefix="/v1/datasets", tags=["balance"])


@router.get("/{dataset_id}/balance", responses=refused(404))
def get_balance(access: Reading, dataset_id: UUID) -> Balance:
    """Compare requested, planned and delivered images, per value and per pair of values."""
    with access.snapshot() as mine:
        return access.parts.balances.of(mine, dataset_id)
