"""What the plan of each dataset adds up to: one row, written when the dataset is submitted."""

from dataclasses import asdict
from uuid import UUID

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from hi5_common.db import errors
from hi5_common.db.tables import PlannedRow
from hi5_common.domain.records import Tallies


def keep(session: Session, dataset_id: UUID, tallies: Tallies) -> None:
    """Insert what a new dataset's plan adds up to."""
    session.execute(insert(PlannedRow).values(dataset_id=dataset_id, tallies=asdict(tallies)))


def tallies(session: Session, dataset_id: UUID) -> Tallies:
    """Return what the plan of a dataset adds up to. Raises DatasetNotFound."""
    document = session.scalar(select(PlannedRow.tallies).where(PlannedRow.dataset_id == dataset_id))
    if document is None:
        raise errors.DatasetNotFound(dataset_id)
    return Tallies(**document)
