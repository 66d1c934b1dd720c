"""Where a dataset is read from: the service, or its rows and its store directly."""

from collections.abc import Iterator
from typing import Protocol
from uuid import UUID

from hi5_common.domain.balance import Balance
from hi5_common.domain.errors import PermanentError, TransientError
from hi5_common.domain.manifest import Manifest, ManifestObject, ManifestShard
from hi5_common.domain.records import DatasetStatus
from hi5_common.domain.rights import Rights
from hi5_common.domain.spec import DatasetSpec


class ObjectGone(PermanentError):
    """A row names an object that the store does not have."""


class TransferBroken(TransientError):
    """The transfer broke off in the middle of an object. Run the same command again."""


class DatasetSource(Protocol):
    """One dataset, to be read."""

    @property
    def dataset_id(self) -> UUID: ...

    @property
    def address(self) -> str:
        """The dataset's page, or its URN where no service is asked."""

    def manifest(self) -> Manifest:
        """Return the manifest's head; it may have shards."""

    def rights(self) -> Rights:
        """Return what the licences of its assets allow."""

    def spec(self) -> DatasetSpec:
        """Return what was asked for."""

    def status(self) -> DatasetStatus:
        """Return how far it is."""

    def shards(self) -> Iterator[ManifestShard]:
        """Yield every shard in order."""

    def stream(self, shard: ManifestShard, item: ManifestObject) -> Iterator[bytes]:
        """Yield a published object's bytes. Raises ObjectGone, TransferBroken."""

    def balance(self) -> Balance:
        """Return requested, planned and delivered counts."""
