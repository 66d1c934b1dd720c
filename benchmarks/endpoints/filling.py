"""A dataset all of whose shards are delivered, by the very functions that a worker calls.

Only commits are fewer than a fleet's: TOGETHER shards share one. Objects are keys, sizes and hashes
without bytes behind them; tallies are counted a shard at a time instead of an image at a time.
"""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from uuid import UUID

import numpy as np

from hi5_common.db import datasets, shards
from hi5_common.db.engine import Database
from hi5_common.domain import keys
from hi5_common.domain.plan import Plan
from hi5_common.domain.records import (
    Gap,
    Publication,
    Redraw,
    Shard,
    StoredObject,
    Tallies,
    without_gaps,
)
from hi5_common.domain.tallies import pair_key, value_key
from hi5_common.domain.vocabulary import Attribute

TOGETHER = 500
OWNER = "benchmark"
LEASE_S = 3600.0
GAP_EVERY, REDRAW_EVERY = 97, 41
"""Of so many shards, one lacks its first image, or has a later draw of its last."""
REASON = "crash: failed 3 times; killed by SIGSEGV; log: (none)"
BYTES_OF_AN_IMAGE = {keys.SAMPLES: 96_000, keys.LABELS: 2_400, keys.MEMBERS: 310}


@dataclass(frozen=True)
class Counting:
    """Counts the images of a plan as `tallies.tally` does, in arrays."""

    plan: Plan

    def of(self, images: Sequence[int]) -> Tallies:
        """Return the tallies of some images."""
        rows = self.plan.order.rows(np.asarray(images, dtype=np.int64)).astype(np.int64)
        values = {word: len(images) for word in self._fixed}
        pairs: dict[str, int] = {}
        for place, words in enumerate(self._values):
            values |= _occurring(rows[:, place], words)
        for (a, b), words in self._pairs.items():
            pairs |= _occurring(rows[:, a] * len(self._values[b]) + rows[:, b], words)
        return Tallies(values, pairs)

    @cached_property
    def _fixed(self) -> list[str]:
        levels, crossed = self.plan.levels, self.plan.crossed
        return [value_key(a, level.values[0]) for a, level in levels.items() if a not in crossed]

    @cached_property
    def _values(self) -> list[list[str]]:
        return [[value_key(*item) for item in self._items(name)] for name in self.plan.crossed]

    @cached_property
    def _pairs(self) -> dict[tuple[int, int], list[str]]:
        return {
            (i, j): [pair_key(*pair) for pair in product(self._items(a), self._items(b))]
            for (i, a), (j, b) in combinations(enumerate(self.plan.crossed), 2)
        }

    def _items(self, name: Attribute) -> list[tuple[Attribute, str]]:
        return [(name, value) for value in self.plan.levels[name].values]


def deliver(database: Database, plan: Plan) -> UUID:
    """Submit a dataset, claim and finish all its shards; return its id."""
    with database.transaction() as session:
        dataset_id = datasets.create(session, plan.spec, plan).dataset.id
    counting, after = Counting(plan), None
    while (after := _deliver_some(database, dataset_id, after, counting)) is not None:
        pass
    return dataset_id


def publication_of(shard: Shard, counting: Counting) -> Publication:
    """Return what a worker would publish of a shard, its objects' bytes aside."""
    gaps, redraws = tuple(_gaps(shard)), tuple(_redraws(shard))
    images = without_gaps(shard.start, shard.stop, gaps)
    prefix = keys.shard_prefix(shard.dataset_id, shard.number, shard.attempt)
    samples, labels, members = (
        _stored(f"{prefix}/{name}", each * len(images)) for name, each in BYTES_OF_AN_IMAGE.items()
    )
    tallies = counting.of(images)
    return Publication(samples, labels, members, len(images), tallies, gaps, redraws)


def _deliver_some(
    database: Database, dataset_id: UUID, after: int | None, counting: Counting
) -> int | None:
    """Claim and finish shards after a number in one transaction; return the last, or None."""
    with database.transaction() as session:
        waiting = shards.of_dataset(session, dataset_id, TOGETHER, after)
        for each in waiting:
            shard = shards.claim(session, each.id, OWNER, LEASE_S)
            if shard is None or shard.id != each.id:
                raise SystemExit(f"shard {each.number} could not be claimed: is a worker running?")
            publication = publication_of(shard, counting)
            shards.finish(session, shard.id, shard.attempt, OWNER, publication)
    return waiting[-1].number if waiting else None


def _gaps(shard: Shard) -> Iterator[Gap]:
    if shard.number % GAP_EVERY == GAP_EVERY - 1 and shard.stop - shard.start > 1:
        yield Gap(shard.start, REASON)


def _redraws(shard: Shard) -> Iterator[Redraw]:
    if shard.number % REDRAW_EVERY == REDRAW_EVERY - 1:
        yield Redraw(shard.stop - 1, 1, REASON)


def _stored(key: str, size_bytes: int) -> StoredObject:
    return StoredObject(key, size_bytes, hashlib.sha256(key.encode()).hexdigest())


def _occurring(codes: np.ndarray, words: Sequence[str]) -> dict[str, int]:
    found, counts = np.unique(codes, return_counts=True)
    return {words[code]: count for code, count in zip(found.tolist(), counts.tolist(), strict=True)}
