"""What an owner has, and whether there is room for more."""

from dataclasses import dataclass

from sqlalchemy import Float, case, cast, func, select
from sqlalchemy.orm import Session

from hi5_common.db.errors import QuotaExceeded
from hi5_common.db.tables import ApiKeyRow, DatasetRow, DeliveryRow
from hi5_common.domain.access import LOCAL_OWNER, NO_QUOTA, Quota
from hi5_common.domain.cost import Cost
from hi5_common.domain.errors import Problem

_FIELDS = {"images": "count", "pixels": "image", "samples": "render"}
"""The part of a spec to make smaller."""


@dataclass(frozen=True)
class Holding:
    """Whose a new dataset is to be, and the most that this owner may have then."""

    owner: str
    quota: Quota = NO_QUOTA


LOCAL_HOLDING = Holding(LOCAL_OWNER)


def used(session: Session, owner: str) -> Cost:
    """Return what all datasets of an owner come to: of a cancelled one, what it delivered."""
    share = case(
        (DatasetRow.cancel_requested_at.is_(None), 1.0),
        else_=cast(DeliveryRow.images_done, Float) / DatasetRow.image_count,
    )
    # As floats: a few datasets of the largest size are more than an integer of 64 bits holds.
    sums = [
        func.coalesce(func.sum(cast(column, Float) * share), 0.0)
        for column in (DatasetRow.image_count, DatasetRow.pixels, DatasetRow.samples)
    ]
    found = session.execute(
        select(*sums)
        .join(DeliveryRow, DeliveryRow.dataset_id == DatasetRow.id)
        .where(DatasetRow.owner == owner)
    ).one()
    return Cost(*(round(number) for number in found))


def take_turn(session: Session, holding: Holding) -> None:
    """Wait for the owner's other submissions that have a quota, and let those wait for this one.

    The first act of a transaction that asks for room later: what it reads then is what they made.
    """
    if not holding.quota.is_limited:
        return
    mine = select(ApiKeyRow.id).where(ApiKeyRow.owner == holding.owner).order_by(ApiKeyRow.id)
    session.execute(mine.with_for_update(key_share=True))


def require_room(session: Session, holding: Holding, cost: Cost) -> None:
    """Check that a new dataset fits, in the transaction that makes it. Raises QuotaExceeded."""
    if not holding.quota.is_limited:
        return
    present = used(session, holding.owner)
    problems = [
        problem
        for name, field in _FIELDS.items()
        if (problem := _lack(name, field, holding.quota, present, cost)) is not None
    ]
    if problems:
        raise QuotaExceeded(problems)


def _lack(name: str, field: str, quota: Quota, present: Cost, cost: Cost) -> Problem | None:
    most, has, wants = (getattr(found, name) for found in (quota, present, cost))
    if most is None or has + wants <= most:
        return None
    remedy = (
        f"That is {wants:,} {name}; of {most:,} that the key's owner may have, "
        f"{max(0, most - has):,} are left. Ask for less, or delete a dataset."
    )
    return Problem(field, wants, remedy)
