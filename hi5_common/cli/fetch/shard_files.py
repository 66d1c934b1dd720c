"""The files of one published shard, as they lie on disk after a download."""

import json
import re
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from hi5_common.domain.keys import LABELS, MEMBERS, SAMPLES
from hi5_common.domain.manifest import ManifestShard

_IMAGE = re.compile(r"(\d{9,})\.(jpg|png)")


@dataclass(frozen=True)
class Member:
    """One file inside a tar, and where its bytes are."""

    name: str
    offset: int
    size_bytes: int


@dataclass(frozen=True)
class ListedMember:
    """What members.json says of one file."""

    name: str
    offset: int
    size: int
    sha256: str


@dataclass(frozen=True)
class ShardFiles:
    """A folder with samples.tar, labels.parquet and members.json."""

    folder: Path

    @property
    def samples(self) -> Path:
        return self.folder / SAMPLES

    @property
    def labels(self) -> Path:
        return self.folder / LABELS

    def members(self) -> Iterator[Member]:
        """Yield what is really in the tar."""
        with tarfile.open(self.samples) as tar:
            for item in tar:
                yield Member(item.name, item.offset_data, item.size)

    def listed(self) -> list[ListedMember]:
        """Return what members.json says is in the tar."""
        document = json.loads((self.folder / MEMBERS).read_text("utf-8"))
        return [ListedMember(**item) for item in document["members"]]

    def read(self, offset: int, size: int) -> bytes:
        """Return a range of the tar, as the API reads single images."""
        with self.samples.open("rb") as file:
            file.seek(offset)
            return file.read(size)

    def unpack_images(self, folder: Path) -> None:
        """Write every image into a folder.

        What no worker writes is left in the tar: other names, links, sparse files.
        """
        with tarfile.open(self.samples) as tar:
            for item in tar:
                # A sparse file of some bytes may say that it is of terabytes.
                plain = item.isreg() and not item.issparse() and _IMAGE.fullmatch(item.name)
                content = tar.extractfile(item) if plain else None
                if content is not None:
                    (folder / item.name).write_bytes(content.read())


def shard_files(root: Path, shard: ManifestShard) -> ShardFiles:
    """Return where a shard's files lie under the download folder."""
    return ShardFiles(root / "shards" / f"{shard.number:06d}")
