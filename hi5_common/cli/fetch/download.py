"""A dataset into a folder, verified, so that a broken-off download goes on where it stopped."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from hi5_common.cli.failures import OutcomeError
from hi5_common.cli.fetch import verified
from hi5_common.cli.fetch.shard_files import shard_files
from hi5_common.cli.fetch.source import DatasetSource, ObjectGone
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.manifest import ManifestShard
from hi5_common.domain.records import ShardStatus
from hi5_common.export.coco import write_coco
from hi5_common.export.label_table import read_label_table, write_label_table

IMAGES = "images"
LABELS = "labels.parquet"
COCO = "coco.json"
BALANCE = "balance.json"
SPEC = "spec.json"


class NothingPublished(OutcomeError):
    """No shard of the dataset is published yet. `hi5 watch` shows how far it is."""


class ShardsLost(OutcomeError):
    """Some published shards could not be read; all others were downloaded."""

    def __init__(self, reasons: dict[int, str]) -> None:
        self.reasons = reasons
        shards = "; ".join(f"shard {number}: {why}" for number, why in reasons.items())
        super().__init__(
            f"{len(reasons)} shards could not be downloaded; all others were. {shards} "
            "Run it again; if that does not help, `hi5 audit` names every damaged object."
        )


@dataclass(frozen=True)
class Downloaded:
    """What lies in the folder now."""

    shards: int
    images: int
    size_bytes: int


def published(source: DatasetSource) -> list[ManifestShard]:
    """Return the shards that can be downloaded, in order. Raises NothingPublished."""
    found = [shard for shard in source.shards() if shard.status is ShardStatus.DONE]
    if not found:
        raise NothingPublished
    return found


def fetch_shards(
    source: DatasetSource,
    shards: Sequence[ManifestShard],
    root: Path,
    seen: Callable[[int], None] = lambda _bytes: None,
) -> Downloaded:
    """Fetch each shard's objects into root/shards/, skipping what is there and verified."""
    for shard in shards:
        _fetch_shard(source, shard, root, seen)
    return downloaded(shards)


def fetch_readable(
    source: DatasetSource,
    shards: Sequence[ManifestShard],
    root: Path,
    seen: Callable[[int], None] = lambda _bytes: None,
) -> tuple[list[ManifestShard], dict[int, str]]:
    """Fetch like fetch_shards, past damaged shards: return what arrived, and why others did not."""
    arrived: list[ManifestShard] = []
    lost: dict[int, str] = {}
    for shard in shards:
        try:
            _fetch_shard(source, shard, root, seen)
            arrived.append(shard)
        except (ObjectGone, verified.WrongDownload) as error:
            lost[shard.number] = str(error)
    return arrived, lost


def downloaded(shards: Sequence[ManifestShard]) -> Downloaded:
    """Add up shards that lie in the folder."""
    images = sum(len(shard.images()) for shard in shards)
    return Downloaded(shards=len(shards), images=images, size_bytes=size_of(shards))


def _fetch_shard(
    source: DatasetSource, shard: ManifestShard, root: Path, seen: Callable[[int], None]
) -> None:
    folder = shard_files(root, shard).folder
    folder.mkdir(parents=True, exist_ok=True)
    for item in shard.objects:
        target = folder / item.name
        if verified.is_verified(target, item):
            seen(item.size_bytes)
        else:
            verified.fetch(source.stream(shard, item), target, item, seen)


def size_of(shards: Sequence[ManifestShard]) -> int:
    """Return the bytes of all objects of the shards."""
    return sum(item.size_bytes for shard in shards for item in shard.objects)


def assemble(source: DatasetSource, shards: Sequence[ManifestShard], root: Path) -> None:
    """Write labels.parquet, coco.json, spec.json and balance.json of the shards, in index order."""
    write_label_table(root / LABELS, labels_of(shards, root))
    write_coco(root / COCO, read_label_table(root / LABELS), source.spec(), image_dir_name=IMAGES)
    (root / SPEC).write_text(source.spec().canonical_json() + "\n", "utf-8")
    (root / BALANCE).write_text(source.balance().model_dump_json(indent=2) + "\n", "utf-8")


def unpack(shards: Sequence[ManifestShard], root: Path) -> None:
    """Write every image of the fetched shards into root/images/."""
    folder = root / IMAGES
    folder.mkdir(exist_ok=True)
    for shard in shards:
        shard_files(root, shard).unpack_images(folder)


def labels_of(shards: Sequence[ManifestShard], root: Path) -> Iterator[ImageLabel]:
    """Yield the labels of the fetched shards in index order."""
    for shard in shards:
        yield from read_label_table(shard_files(root, shard).labels)
