"""Takes the labels and pictures of a published shard into the columns of a fairness audit."""

from collections.abc import Sequence
from dataclasses import dataclass

from hi5_common.cli.fetch.shard_files import ShardFiles
from hi5_common.domain.labels import ImageLabel
from hi5_common.fairness.looks import Look, look_at
from hi5_common.fairness.observed import Observed


@dataclass(frozen=True, eq=False)
class Observing:
    """Adds shards to `observed`; without pixels only their labels."""

    observed: Observed
    pixels: bool

    def add(self, files: ShardFiles, labels: Sequence[ImageLabel]) -> None:
        """Add a shard, all of it or nothing. Raises ValueError for what is no picture.

        A label whose picture is not in the tar is left out: its image was not delivered.
        """
        members = {member.name: member for member in files.members()}
        delivered = [label for label in labels if label.file_name in members]
        looks: list[Look | None] = [None] * len(delivered)
        if self.pixels:
            images = [members[label.file_name] for label in delivered]
            contents = (files.read(image.offset, image.size_bytes) for image in images)
            looks = [look_at(*pair) for pair in zip(contents, delivered, strict=True)]
        for label, look in zip(delivered, looks, strict=True):
            self.observed.add(label, look)
