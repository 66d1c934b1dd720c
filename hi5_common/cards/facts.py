"""What a card is written from: a dataset as it stands, in one value."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from hi5_common.domain.balance import requested_counts
from hi5_common.domain.environments import CATALOGUE
from hi5_common.domain.light import LightLevel, light_level
from hi5_common.domain.manifest import Manifest, ManifestShard, Progress
from hi5_common.domain.records import DatasetStatus, Gap, Redraw
from hi5_common.domain.rights import Rights
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.tallies import value_key
from hi5_common.domain.vocabulary import Attribute

SETTLED = frozenset({DatasetStatus.COMPLETE, DatasetStatus.COMPLETE_WITH_GAPS})
MOST_NAMED = 50
"""Gaps and redraws that a card names; the manifest names all."""


@dataclass(frozen=True)
class ValueCount:
    """Images of one value: asked for (shares may be fractions), and delivered."""

    value: str
    requested: float
    delivered: int


@dataclass(frozen=True)
class AttributeCounts:
    """The values of an attribute that a dataset asks for, in canonical order."""

    attribute: Attribute
    values: tuple[ValueCount, ...]


@dataclass(frozen=True)
class Troubles:
    """Images that are missing, and later draws. all_named: whether these are all there are."""

    gaps: tuple[Gap, ...] = ()
    redrawn: tuple[Redraw, ...] = ()
    all_named: bool = True

    @classmethod
    def of(
        cls, gaps: Iterable[Gap], redrawn: Iterable[Redraw], *, all_given: bool = True
    ) -> "Troubles":
        """Keep the first of each."""
        missing, later = tuple(gaps), tuple(redrawn)
        few = max(len(missing), len(later)) <= MOST_NAMED
        return cls(missing[:MOST_NAMED], later[:MOST_NAMED], all_given and few)


@dataclass(frozen=True)
class CardFacts:
    """A dataset as it stood when its card was written.

    address: its page, or its URN where no service was asked. creator: who publishes it, if told.
    """

    dataset_id: UUID
    address: str
    creator: str | None
    status: DatasetStatus
    created_at: datetime
    spec: DatasetSpec
    progress: Progress
    counts: tuple[AttributeCounts, ...]
    troubles: Troubles
    rights: Rights
    hi5_version: str

    @property
    def is_settled(self) -> bool:
        """Whether no image is to come."""
        return self.status in SETTLED

    @property
    def choices(self) -> tuple[AttributeCounts, ...]:
        """The attributes that the dataset has more than one value of."""
        return tuple(item for item in self.counts if len(item.values) > 1)

    @property
    def fixed(self) -> dict[Attribute, str]:
        """The one value of each of the other attributes."""
        return {c.attribute: c.values[0].value for c in self.counts if len(c.values) == 1}


def facts_of(
    head: Manifest,
    troubles: Troubles,
    rights: Rights,
    *,
    address: str,
    hi5_version: str,
    creator: str | None = None,
) -> CardFacts:
    """Gather a card's facts. head: any page of the manifest; its shards are not looked at."""
    return CardFacts(
        dataset_id=head.dataset_id,
        address=address,
        creator=creator,
        status=head.status,
        created_at=head.created_at,
        spec=head.spec,
        progress=head.progress,
        counts=tuple(_counts(head, attribute) for attribute in Attribute),
        troubles=troubles,
        rights=rights,
        hi5_version=hi5_version,
    )


def troubles_of(shards: Sequence[ManifestShard], *, all_given: bool = True) -> Troubles:
    """Gather the gaps and redraws of shards."""
    gaps = (gap for shard in shards for gap in shard.gaps)
    redrawn = (one for shard in shards for one in shard.redrawn)
    return Troubles.of(gaps, redrawn, all_given=all_given)


def low_light(facts: CardFacts) -> int | None:
    """Return the delivered images in places of low light; None if any place is not built in."""
    (places,) = (c for c in facts.counts if c.attribute is Attribute.ENVIRONMENT)
    if any(item.value not in CATALOGUE for item in places.values):
        return None
    return sum(
        item.delivered
        for item in places.values
        if light_level(CATALOGUE[item.value].luminance) is LightLevel.LOW
    )


def _counts(head: Manifest, attribute: Attribute) -> AttributeCounts:
    values = tuple(
        ValueCount(value, requested, head.tallies.get(value_key(attribute, value), 0))
        for value, requested in requested_counts(head.spec, attribute).items()
    )
    return AttributeCounts(attribute, values)
