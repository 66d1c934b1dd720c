"""From the files of a shard's images to the three objects that are published.

samples.tar follows WebDataset: for each image `{index:09d}.jpg` (or .png) and `{index:09d}.json`,
in order, with fixed header fields, so that the same images give the same bytes.
"""

import errno
import hashlib
import io
import json
import tarfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from hi5_common.domain import keys, tallies
from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.records import Tallies
from hi5_common.domain.retry import FailureKind
from hi5_common.domain.vocabulary import Attribute
from hi5_common.export.label_table import write_label_table
from hi5_common.storage import full_disk
from services.worker.fleet.attempt_errors import AttemptFailed
from services.worker.fleet.shard_render import RenderedImage

_REMEDY = "make room there, or name another place in HI5_SCRATCH_DIR."
_HEADER_BYTES = tarfile.BLOCKSIZE  # USTAR: one block, as long as names are short


@dataclass(frozen=True)
class Member:
    """Where a file lies in samples.tar: bytes [offset, offset + size)."""

    name: str
    offset: int
    size: int
    sha256: str


@dataclass(frozen=True)
class PackedFile:
    """A file to be published, with its SHA-256 in hex."""

    name: str
    path: Path
    sha256: str


@dataclass(frozen=True)
class PackedShard:
    """What a shard's images become."""

    samples: PackedFile
    labels: PackedFile
    members: PackedFile
    image_count: int
    tallies: Tallies


def pack(
    images: Sequence[RenderedImage], folder: Path, crossed: Iterable[Attribute]
) -> PackedShard:
    """Write samples.tar, labels.parquet and members.json into `folder`.

    crossed: the attributes whose pairs are counted.

    Raises AttemptFailed if a file no longer has the SHA-256 it was accepted with, or if the disk
    is full.
    """
    try:
        return _pack(images, folder, crossed)
    except OSError as error:
        told = full_disk.told(error, folder, _REMEDY)
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        kind = FailureKind.DISK_FULL if full else FailureKind.WORKER
        raise AttemptFailed(kind, f"the shard cannot be packed: {told}") from error


def _pack(
    images: Sequence[RenderedImage], folder: Path, crossed: Iterable[Attribute]
) -> PackedShard:
    members = _write_tar(folder / keys.SAMPLES, images)
    write_label_table(folder / keys.LABELS, _labels(images))
    document = {"members": [asdict(member) for member in members]}
    (folder / keys.MEMBERS).write_text(json.dumps(document, separators=(",", ":")), "utf-8")
    return PackedShard(
        samples=_packed(folder / keys.SAMPLES),
        labels=_packed(folder / keys.LABELS),
        members=_packed(folder / keys.MEMBERS),
        image_count=len(images),
        tallies=tallies.tally((label.attributes for label in _labels(images)), crossed),
    )


def _write_tar(path: Path, images: Sequence[RenderedImage]) -> list[Member]:
    members: list[Member] = []
    with tarfile.open(path, "w", format=tarfile.USTAR_FORMAT) as tar:
        for image in images:
            members.append(_add(tar, image.image_path, image.image_sha256))
            members.append(_add(tar, image.label_path, image.label_sha256))
    return members


def _add(tar: tarfile.TarFile, path: Path, sha256: str) -> Member:
    data = path.read_bytes()
    if hashlib.sha256(data).hexdigest() != sha256:
        raise AttemptFailed(FailureKind.WRONG_BYTES, f"{path.name} changed on disk")
    header = tarfile.TarInfo(path.name)
    header.size = len(data)
    header.mode = 0o644
    member = Member(path.name, tar.offset + _HEADER_BYTES, len(data), sha256)
    tar.addfile(header, io.BytesIO(data))
    return member


def _labels(images: Sequence[RenderedImage]) -> Iterator[ImageLabel]:
    for image in images:
        yield ImageLabel.model_validate_json(image.label_path.read_bytes())


def _packed(path: Path) -> PackedFile:
    with path.open("rb") as file:
        return PackedFile(path.name, path, hashlib.file_digest(file, "sha256").hexdigest())
