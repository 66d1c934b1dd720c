"""Datasets as a caller may see them: whatever a request reads or changes goes through here.

A dataset of another owner is not there: DatasetNotFound, as for an id that nobody has.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy.orm import Session

from hi5_common.db import datasets, deliveries, errors, events, failures, planned, shards
from hi5_common.db.datasets import CreatedDataset, ShardPlan
from hi5_common.db.events import Event as Event  # part of this module's interface
from hi5_common.db.quotas import Holding
from hi5_common.domain.access import Caller
from hi5_common.domain.failures import Failure
from hi5_common.domain.records import Dataset, Shard, ShardStatus, Tallies
from hi5_common.domain.spec import DatasetSpec


@dataclass(frozen=True)
class OwnedDatasets:
    """What of the database is there for a caller, in one session.

    Every method that takes a dataset's id raises DatasetNotFound.
    """

    session: Session
    caller: Caller

    def create(
        self, spec: DatasetSpec, plan: ShardPlan, idempotency_key: str | None
    ) -> CreatedDataset:
        """Insert a dataset of the caller's. Raises IdempotencyConflict, QuotaExceeded."""
        holding = Holding(self.caller.owner, self.caller.quota)
        return datasets.create(
            self.session, spec, plan, holding=holding, idempotency_key=idempotency_key
        )

    def page(self, limit: int, after_id: UUID | None) -> list[Dataset]:
        """Return the newest first, those after `after_id`."""
        owner = None if self.caller.sees_all else self.caller.owner
        return datasets.page(self.session, limit, after_id, owner)

    def get(self, dataset_id: UUID) -> Dataset:
        """Return a dataset with its counts."""
        self.require(dataset_id)
        return datasets.get(self.session, dataset_id)

    def spec(self, dataset_id: UUID) -> DatasetSpec:
        """Return only its spec."""
        self.require(dataset_id)
        return datasets.spec(self.session, dataset_id)

    def request_cancel(self, dataset_id: UUID) -> Dataset:
        """Ask for no more images."""
        self.require(dataset_id)
        return datasets.request_cancel(self.session, dataset_id)

    def retry_failed(self, dataset_id: UUID) -> int:
        """Make failed shards pending again; return how many."""
        self.require(dataset_id)
        count = datasets.retry_failed(self.session, dataset_id)
        self.session.expire_all()
        return count

    def delete(self, dataset_id: UUID) -> None:
        """Delete a dataset. Raises DatasetInUse."""
        self.require(dataset_id)
        datasets.delete(self.session, dataset_id)

    def shards(
        self,
        dataset_id: UUID,
        limit: int,
        after_number: int | None = None,
        status: ShardStatus | None = None,
    ) -> list[Shard]:
        """Return shards in order of their number."""
        self.require(dataset_id)
        return shards.of_dataset(self.session, dataset_id, limit, after_number, status)

    def shard(self, dataset_id: UUID, number: int) -> Shard:
        """Return one shard. Raises ShardNotFound."""
        self.require(dataset_id)
        return shards.get(self.session, dataset_id, number)

    def shard_of_image(self, dataset_id: UUID, index: int) -> Shard:
        """Return the shard that an image belongs to. Raises ImageNotFound."""
        self.require(dataset_id)
        return shards.containing(self.session, dataset_id, index)

    def shards_in_trouble(self, dataset_id: UUID, limit: int) -> list[Shard]:
        """Return the first published shards that have gaps or redraws."""
        self.require(dataset_id)
        return shards.in_trouble(self.session, dataset_id, limit)

    def shards_done(self, dataset_id: UUID) -> int:
        """Return how many shards are in the sum of what is delivered."""
        self.require(dataset_id)
        return deliveries.shards_done(self.session, dataset_id)

    def delivered(self, dataset_id: UUID) -> Tallies:
        """Return what the published shards add up to."""
        self.require(dataset_id)
        return deliveries.tallies(self.session, dataset_id)

    def planned(self, dataset_id: UUID) -> Tallies:
        """Return what the plan adds up to."""
        self.require(dataset_id)
        return planned.tallies(self.session, dataset_id)

    def latest_events(self, dataset_id: UUID, limit: int) -> Sequence[Event]:
        """Return what happened, the newest first."""
        self.require(dataset_id)
        return events.of_latest(self.session, dataset_id, limit)

    def failures(self, dataset_id: UUID, limit: int, before: int | None) -> list[Failure]:
        """Return what failed, the newest first: all, or what is older than `before`."""
        self.require(dataset_id)
        return failures.of_dataset(self.session, dataset_id, limit, before)

    def shards_to_ring(self, limit: int, ring_s: float) -> list[UUID]:
        """Return shards to announce, whosever: workers take the oldest first."""
        return shards.pending_to_ring(self.session, limit, ring_s)

    def require(self, dataset_id: UUID) -> None:
        """Check that a dataset is there for the caller."""
        if not self.caller.may_see(datasets.owner_of(self.session, dataset_id)):
            raise errors.DatasetNotFound(dataset_id)
