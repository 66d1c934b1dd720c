"""What failed of a dataset, with the scenes."""

from uuid import UUID

from hi5_common.db import datasets, failures
from hi5_common.domain.failure_report import FailureReport, report_of
from services.api.parts import Parts


def newest(
    parts: Parts, dataset_id: UUID, limit: int, before: int | None = None
) -> list[FailureReport]:
    """Return what failed, the newest first. Raises DatasetNotFound."""
    with parts.database.snapshot() as session:
        spec = datasets.spec(session, dataset_id)
        found = failures.of_dataset(session, dataset_id, limit, before)
    plan = parts.plans.of(spec) if found else None
    return [] if plan is None else [report_of(each, dataset_id, spec, plan) for each in found]
