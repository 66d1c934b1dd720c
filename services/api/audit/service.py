"""The audit of what a dataset has delivered, from its labels."""

from dataclasses import dataclass
from uuid import UUID

from hi5_common.domain.records import TO_COME, Dataset, ShardStatus
from hi5_common.fairness.report import Fairness
from services.api.access.access import Access
from services.api.audit.audits import Settled


@dataclass(frozen=True)
class Audited:
    """A dataset and its audit: None while that is made, and if too much is delivered for one."""

    dataset: Dataset
    max_images: int
    report: Fairness | None

    @property
    def too_many(self) -> bool:
        return self.dataset.images_done > self.max_images

    @property
    def command(self) -> str:
        """Return the command that audits labels and pictures."""
        return f"hi5 audit {self.dataset.id} --out audit"


def audited(access: Access, dataset_id: UUID, max_images: int) -> Audited:
    """Return a dataset's audit, or begin it if no more than max_images are delivered.

    While images are still to come, one that was made a little earlier will do, and a newer one is
    begun. Raises DatasetNotFound, and what the making raised.
    """
    with access.snapshot() as mine:
        dataset = mine.get(dataset_id)
    if dataset.images_done > max_images:
        return Audited(dataset, max_images, None)
    shards = dataset.shards_by_status
    settled = Settled(
        shards.get(ShardStatus.DONE, 0),
        dataset.images_done,
        shards.get(ShardStatus.FAILED, 0) + shards.get(ShardStatus.CANCELLED, 0),
    )
    grows = any(shards.get(status) for status in TO_COME)
    report = access.parts.audits.of(dataset_id, settled, or_earlier=grows)
    return Audited(dataset, max_images, report)
