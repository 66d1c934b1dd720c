"""Where a dataset's files are: beside its card as `hi5 download` lays them out, or at a service."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from uuid import UUID

from hi5_common.domain import keys
from hi5_common.domain.manifest import ManifestObject, ManifestShard
from hi5_common.domain.records import ShardStatus

MOST_SHARDS = 100
"""Datasets of more shards are described by patterns; their files' hashes are listed elsewhere."""
CHECKSUMS = "SHA256SUMS"

TAR, PARQUET, JSON, TEXT = (
    "application/x-tar",
    "application/x-parquet",
    "application/json",
    "text/plain",
)
_FORMATS = {keys.SAMPLES: TAR, keys.LABELS: PARQUET, keys.MEMBERS: JSON}


@dataclass(frozen=True)
class ListedFile:
    """A file with its hash; id is its path as `hi5 download` lays it out."""

    id: str
    url: str
    media_type: str
    size_bytes: int
    sha256: str


@dataclass(frozen=True)
class Distribution:
    """The files that are listed. tars_hold_pictures: pictures are read out of the listed tars.

    checksums: what has the hashes of files that are not listed, in words.
    """

    listed: tuple[ListedFile, ...]
    tars_hold_pictures: bool
    checksums: str

    @property
    def tars(self) -> tuple[ListedFile, ...]:
        return tuple(file for file in self.listed if file.media_type == TAR)


def at_service(
    base: str, dataset_id: UUID, shards: Sequence[ManifestShard], *, all_given: bool
) -> Distribution:
    """Describe files where a service serves them; base: its address, without a closing slash.

    shards: the published ones, if there are few enough to be listed (all_given).
    """
    address = f"{base}/v1/datasets/{dataset_id}"
    manifest = f"the manifest, {address}/manifest, has size and SHA-256 of every file"
    if not all_given:
        return Distribution((), False, manifest)
    listed = tuple(
        _file(shard, item, f"{address}/shards/{shard.number}/objects/{item.name}")
        for shard, item in _published(shards)
    )
    return Distribution(listed, bool(listed), manifest)


def beside(shards: Sequence[ManifestShard], checksums: ListedFile) -> Distribution:
    """Describe files as they lie beside the card; checksums: of the file that `sums` wrote."""
    found = [shard for shard in shards if shard.status is ShardStatus.DONE]
    listed: Iterable[ListedFile] = ()
    if len(found) <= MOST_SHARDS:
        listed = (_file(shard, item, _path(shard, item)) for shard, item in _published(found))
    words = f"{CHECKSUMS} beside this file has the SHA-256 of every file (sha256sum -c {CHECKSUMS})"
    return Distribution((checksums, *listed), False, words)


def sums(shards: Sequence[ManifestShard]) -> str:
    """Return what `sha256sum -c` reads, of every published file, in order."""
    return "".join(f"{item.sha256}  {_path(shard, item)}\n" for shard, item in _published(shards))


def _published(
    shards: Sequence[ManifestShard],
) -> Iterable[tuple[ManifestShard, ManifestObject]]:
    return ((shard, item) for shard in shards for item in shard.objects)


def _path(shard: ManifestShard, item: ManifestObject) -> str:
    return f"shards/{shard.number:06d}/{item.name}"


def _file(shard: ManifestShard, item: ManifestObject, url: str) -> ListedFile:
    return ListedFile(_path(shard, item), url, _FORMATS[item.name], item.size_bytes, item.sha256)
