"""Datasets and publications for tests of the fleet."""

from collections.abc import Sequence
from dataclasses import dataclass

from hi5_common.db import datasets
from hi5_common.db.engine import Database
from hi5_common.domain.records import Dataset, Gap, Publication, Shard, StoredObject, Tallies
from hi5_common.domain.sharding import ShardRange, shard_ranges
from hi5_common.domain.spec import DatasetSpec, parse_spec


@dataclass(frozen=True)
class Cut:
    """A plan that only knows where shards begin and end."""

    count: int
    size: int

    def shards(self) -> tuple[ShardRange, ...]:
        return tuple(shard_ranges(spec(self.count, self.size)))

    def tallies(self) -> Tallies:
        return Tallies({}, {})

    def tallies_of_first(self, count: int) -> Tallies:
        raise NotImplementedError(f"nothing is extended by {count} images")


def spec(count: int = 6, size: int = 2, **changes: object) -> DatasetSpec:
    """Return a small spec."""
    image = {"width": 64, "height": 48}
    return parse_spec({"count": count, "images_per_shard": size, "image": image, **changes})


def dataset(database: Database, count: int = 6, size: int = 2, **changes: object) -> Dataset:
    """Submit a small dataset."""
    with database.transaction() as session:
        return datasets.create(session, spec(count, size, **changes), Cut(count, size)).dataset


def publication(
    shard: Shard, tallies: Tallies | None = None, missing: Sequence[int] = ()
) -> Publication:
    """Return a publication that holds the shard's images but the missing ones."""
    samples, labels, members = (
        StoredObject(f"{shard.dataset_id}/{shard.number}/{shard.attempt}/{name}", 10, "a" * 64)
        for name in ("samples.tar", "labels.parquet", "members.json")
    )
    gaps = tuple(Gap(index, "failed 5 times") for index in missing)
    count = shard.stop - shard.start - len(gaps)
    return Publication(
        samples, labels, members, count, tallies or Tallies({"gender=male": count}, {}), gaps
    )
