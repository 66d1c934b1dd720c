"""A dataset read from its rows and its store, with no service running."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from uuid import UUID

from hi5_common.cli.fetch.source import ObjectGone
from hi5_common.db import datasets, deliveries, planned, shards
from hi5_common.db.engine import Database
from hi5_common.domain.balance import Balance, balance_of
from hi5_common.domain.manifest import (
    Manifest,
    ManifestObject,
    ManifestShard,
    manifest_head,
    manifest_shard,
)
from hi5_common.domain.records import Dataset, DatasetStatus
from hi5_common.domain.rights import Rights, own_environments, rights_of
from hi5_common.domain.spec import DatasetSpec
from hi5_common.own_places import entries_of
from hi5_common.storage.errors import ObjectMissing
from hi5_common.storage.port import ObjectStore

PAGE = 500


@dataclass(frozen=True)
class DirectSource:
    """Reads one dataset of the database and store that the settings name."""

    database: Database
    store: ObjectStore
    dataset_id: UUID
    assets_dir: Path
    """Where panoramas outside the catalogue have their records."""

    @property
    def address(self) -> str:
        return self.dataset_id.urn

    def manifest(self) -> Manifest:
        with self.database.snapshot() as session:
            row = datasets.get(session, self.dataset_id)
            delivered = deliveries.tallies(session, self.dataset_id)
        return manifest_head(row, delivered)

    def rights(self) -> Rights:
        spec = self.spec()
        return rights_of(spec, entries_of(self.assets_dir, own_environments(spec)))

    def spec(self) -> DatasetSpec:
        return self._row().spec

    def status(self) -> DatasetStatus:
        return self._row().status

    def shards(self) -> Iterator[ManifestShard]:
        after: int | None = None
        while True:
            with self.database.snapshot() as session:
                page = shards.of_dataset(session, self.dataset_id, PAGE, after)
            if not page:
                return
            yield from map(manifest_shard, page)
            after = page[-1].number

    def stream(self, shard: ManifestShard, item: ManifestObject) -> Iterator[bytes]:  # noqa: ARG002
        try:
            yield from self.store.stream(item.key)
        except ObjectMissing:
            raise ObjectGone(f"{item.key}: {ObjectGone.__doc__}") from None

    def balance(self) -> Balance:
        with self.database.snapshot() as session:
            row = datasets.get(session, self.dataset_id)
            plan = planned.tallies(session, self.dataset_id)
            delivered = deliveries.tallies(session, self.dataset_id)
        return balance_of(row.spec, plan, delivered, row.images_done)

    def _row(self) -> Dataset:
        with self.database.snapshot() as session:
            return datasets.get(session, self.dataset_id)
