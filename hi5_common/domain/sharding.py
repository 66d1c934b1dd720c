"""How a dataset is cut into shards: index ranges that a worker renders in a minute or two."""

from collections.abc import Iterator
from dataclasses import dataclass

from hi5_common.domain.spec import DatasetSpec, Quality

TARGET_S = 90.0
MAX_SHARDS = 20_000
SECONDS_PER_MEGAPIXEL = {
    Quality.DRAFT: 5.0,
    Quality.STANDARD: 7.5,
    Quality.HIGH: 33.0,
    Quality.REFERENCE: 600.0,
}
STANDARD_ERROR = 0.017
SECONDS_PER_IMAGE = 0.8
"""For two slow CPU cores, from docs/speed/render.md: seconds at 640 x 640 less what does not grow
with samples; reference by its samples, standard's error from its 35.3 dB. Only the size of shards
depends on them, never an image."""


@dataclass(frozen=True)
class ShardRange:
    """Images [start, stop) of a dataset."""

    number: int
    start: int
    stop: int


def images_per_shard(spec: DatasetSpec) -> int:
    """Return the shard size: what the spec says, else about TARGET_S of estimated work.

    A dataset so large that this would make more than MAX_SHARDS shards gets larger shards.
    """
    if spec.images_per_shard is not None:
        return spec.images_per_shard
    by_time = max(1, min(1000, round(TARGET_S / _seconds_per_image(spec))))
    by_number = -(-spec.count // MAX_SHARDS)
    return max(by_time, by_number)


def _seconds_per_image(spec: DatasetSpec) -> float:
    """Return about how long an image takes, only to size shards by."""
    asked = spec.render
    if asked.seconds_per_image is not None:
        return SECONDS_PER_IMAGE + asked.seconds_per_image
    per_megapixel = SECONDS_PER_MEGAPIXEL[asked.quality or Quality.STANDARD]
    if asked.max_error is not None:  # a denoised error falls with the third root of the samples
        per_megapixel *= (STANDARD_ERROR / asked.max_error) ** 3
    return SECONDS_PER_IMAGE + per_megapixel * spec.image.width * spec.image.height / 1e6


def shard_ranges(spec: DatasetSpec) -> Iterator[ShardRange]:
    """Yield consecutive ranges that cover every image: those of what is extended as they are there,
    then ranges of the spec's own size; the last of each may be shorter.
    """
    number = 0
    if spec.extends is not None:
        for cut in shard_ranges(spec.extends):
            yield cut
            number = cut.number + 1
    size = images_per_shard(spec)
    for own, start in enumerate(range(_begins(spec), spec.count, size)):
        yield ShardRange(number + own, start, min(start + size, spec.count))


def shard_count(spec: DatasetSpec) -> int:
    """Return how many shards a dataset has."""
    earlier = shard_count(spec.extends) if spec.extends is not None else 0
    return earlier - (_begins(spec) - spec.count) // images_per_shard(spec)


def shard_number(spec: DatasetSpec, index: int) -> int:
    """Return the number of the shard that has image `index`."""
    if spec.extends is None:
        return index // images_per_shard(spec)
    if index < spec.extends.count:
        return shard_number(spec.extends, index)
    return shard_count(spec.extends) + (index - spec.extends.count) // images_per_shard(spec)


def _begins(spec: DatasetSpec) -> int:
    return spec.extends.count if spec.extends is not None else 0
