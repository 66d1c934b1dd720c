"""A dataset read through the service's API."""

from collections.abc import Iterator
from dataclasses import dataclass
from uuid import UUID

from hi5_common.cli.client import Service
from hi5_common.cli.fetch.source import ObjectGone
from hi5_common.domain.balance import Balance
from hi5_common.domain.manifest import Manifest, ManifestObject, ManifestShard
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.rights import Rights
from hi5_common.domain.spec import DatasetSpec


@dataclass(frozen=True)
class ApiSource:
    """Reads one dataset of a running service."""

    service: Service
    dataset_id: UUID

    @property
    def address(self) -> str:
        return f"{self.service.url}/datasets/{self.dataset_id}"

    def manifest(self) -> Manifest:
        return self.service.manifest(self.dataset_id)

    def rights(self) -> Rights:
        return self.service.rights(self.dataset_id)

    def spec(self) -> DatasetSpec:
        return self.manifest().spec

    def status(self) -> DatasetStatus:
        return self.manifest().status

    def shards(self) -> Iterator[ManifestShard]:
        return self.service.shards(self.dataset_id)

    def stream(self, shard: ManifestShard, item: ManifestObject) -> Iterator[bytes]:
        address = f"/v1/datasets/{self.dataset_id}/shards/{shard.number}/objects/{item.name}"
        try:
            yield from self.service.stream(address)
        except FileNotFoundError:
            raise ObjectGone(f"{item.key}: {ObjectGone.__doc__}") from None

    def balance(self) -> Balance:
        return self.service.balance(self.dataset_id)
