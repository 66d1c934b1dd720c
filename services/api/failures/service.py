"""What failed of a dataset, with the scenes."""

from uuid import UUID

from hi5_common.domain.failure_report import FailureReport, report_of
from services.api.access.access import Access


def newest(
    access: Access, dataset_id: UUID, limit: int, before: int | None = None
) -> list[FailureReport]:
    """Return what failed, the newest first. Raises DatasetNotFound."""
    with access.snapshot() as mine:
        spec = mine.spec(dataset_id)
        found = mine.failures(dataset_id, limit, before)
    plan = access.parts.plans.of(spec) if found else None
    return [] if plan is None else [report_of(each, dataset_id, spec, plan) for each in found]
