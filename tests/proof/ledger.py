"""What must hold whatever happens: compared after every step with the rows and the objects."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any
from uuid import UUID

from sqlalchemy import Row, select

from hi5_common.db import deliveries, rows
from hi5_common.db.engine import Database
from hi5_common.db.tables import DeliveryRow, EventRow, ShardRow
from hi5_common.domain import tallies as counting
from hi5_common.domain.lifecycle import Transition
from hi5_common.domain.records import Publication, ShardStatus, StoredObject, Tallies
from hi5_common.storage.publish import verify
from tests.support.faulty import FaultyStore

SHARD = select(
    ShardRow.id,
    ShardRow.dataset_id,
    ShardRow.number,
    ShardRow.start,
    ShardRow.stop,
    ShardRow.status,
    ShardRow.attempt,
    ShardRow.lease_owner,
    ShardRow.progress,
    ShardRow.publication,
)
DELIVERY = select(
    DeliveryRow.dataset_id,
    DeliveryRow.shards_done,
    DeliveryRow.images_done,
    DeliveryRow.images_missing,
    DeliveryRow.tallies,
)
FINISHED = select(EventRow.dataset_id, EventRow.shard_number).where(
    EventRow.kind == Transition.FINISH.value
)

ShardNow = Row[tuple[UUID, UUID, int, int, int, str, int, str | None, int, object]]
SumNow = Row[tuple[UUID, int, int, int, dict[str, Any]]]


@dataclass
class Ledger:
    """What users and workers were told, and the rows as they were after the last step.

    made: what every attempt uploaded, by the key of its samples. acknowledged: what a worker was
    told is published. datasets: what a user was told exists, and how many images it has.
    """

    database: Database
    store: FaultyStore
    made: dict[str, Publication] = field(default_factory=dict)
    acknowledged: dict[UUID, Publication] = field(default_factory=dict)
    datasets: dict[UUID, int] = field(default_factory=dict)
    deleted: set[UUID] = field(default_factory=set)
    shards: dict[UUID, ShardNow] = field(default_factory=dict)
    published: dict[UUID, Publication] = field(default_factory=dict)
    refused: bool = False
    seen: object = None
    verified: tuple[int, int] = (-1, -1)

    def check(self) -> None:
        """Compare everything. `refused`: in this step a write was refused, so no row may differ."""
        with self.database.snapshot() as session:
            now = {row.id: row for row in session.execute(SHARD)}
            sums = {row.dataset_id: row for row in session.execute(DELIVERY)}
            ends = Counter((row[0], row[1]) for row in session.execute(FINISHED))
        assert not self.refused or now == self.shards, "a refused write changed a row"
        self.refused = False
        state = (now, sums, ends)
        if state != self.seen:
            self._check_tokens(now)
            self._check_published(now)
            self._check_ends(now, ends)
            for dataset_id, delivered in sums.items():
                self._check_sums(
                    [row for row in now.values() if row.dataset_id == dataset_id], delivered
                )
        self.shards, self.seen = now, state
        self._check_datasets(now)
        self._check_objects()

    def check_counts(self) -> None:
        """Compare what users are shown of each dataset with its rows."""
        with self.database.snapshot() as session:
            counts = deliveries.counts(
                session, sorted({r.dataset_id for r in self.shards.values()})
            )
        for dataset_id, count in counts.items():
            mine = [row for row in self.shards.values() if row.dataset_id == dataset_id]
            found = [self.published[row.id] for row in mine if row.id in self.published]
            leased = [row for row in mine if row.status == ShardStatus.LEASED.value]
            assert count.shards == Counter(ShardStatus(row.status) for row in mine)
            assert count.images_in_progress == sum(row.progress for row in leased)
            assert count.images_done == sum(p.image_count for p in found)
            assert count.images_missing == sum(len(p.gaps) for p in found)

    def _check_tokens(self, now: dict[UUID, ShardNow]) -> None:
        for shard_id, row in now.items():
            before = self.shards.get(shard_id)
            if before is not None:
                assert 0 <= row.attempt - before.attempt <= 1, "a fencing token fell or jumped"
                assert row.attempt == before.attempt or before.status == "pending", "a stolen lease"

    def _check_published(self, now: dict[UUID, ShardNow]) -> None:
        """What was published once stays published so; what a worker was told is so."""
        published = {
            shard_id: rows.publication(row.publication)
            for shard_id, row in now.items()
            if row.status == ShardStatus.DONE.value
        }
        for shard_id, earlier in (*self.published.items(), *self.acknowledged.items()):
            if self.shards[shard_id].dataset_id in self.deleted:
                continue
            found = published.get(shard_id)
            assert found is not None, "a published shard was lost"
            assert found.samples == earlier.samples, "a shard was published twice"
        self.published = published
        self.acknowledged = {k: v for k, v in self.acknowledged.items() if k in published}

    def _check_ends(
        self, now: dict[UUID, ShardNow], ends: Counter[tuple[UUID, int | None]]
    ) -> None:
        rendered = {
            (row.dataset_id, row.number): 1
            for row in now.values()
            if row.status == ShardStatus.DONE.value and row.attempt > 0
        }
        assert dict(ends) == rendered, "shards were published as often as they are done"

    def _check_datasets(self, now: dict[UUID, ShardNow]) -> None:
        images = Counter[UUID]()
        for row in now.values():
            images[row.dataset_id] += row.stop - row.start
        assert not images.keys() & self.deleted, "a deleted dataset came back"
        kept = {i: n for i, n in self.datasets.items() if i not in self.deleted}
        assert images == kept, "a dataset that was submitted is not there, or not whole"

    def _check_sums(self, mine: list[ShardNow], delivered: SumNow) -> None:
        found = [self.published[row.id] for row in mine if row.id in self.published]
        assert delivered.shards_done == len(found)
        assert delivered.images_done == sum(p.image_count for p in found)
        assert delivered.images_missing == sum(len(p.gaps) for p in found)
        recounted = counting.add(*(self.made[p.samples.key].tallies for p in found))
        assert Tallies(**delivered.tallies) == recounted, "running sums differ from a recount"

    def _check_objects(self) -> None:
        state = (self.store.version, len(self.published))
        if state != self.verified:
            for stored in self.referenced():
                verify(self.store.inner, stored)
        self.verified = state

    def referenced(self) -> set[StoredObject]:
        """Return the objects that rows point to."""
        return {
            stored
            for publication in self.published.values()
            for stored in (publication.samples, publication.labels, publication.members)
        }
