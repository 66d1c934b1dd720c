"""A dataset's card out of its rows: one snapshot, however many shards there are."""

from dataclasses import dataclass
from uuid import UUID

from hi5_common.cards.distribution import MOST_SHARDS, Distribution, at_service
from hi5_common.cards.facts import MOST_NAMED, CardFacts, facts_of, troubles_of
from hi5_common.domain.manifest import manifest_head, manifest_shard
from hi5_common.domain.records import ShardStatus
from hi5_common.domain.rights import Rights, rights_of
from hi5_common.version import hi5_version
from services.api.access.access import Access
from services.api.cards.places import own_places


@dataclass(frozen=True)
class Asked:
    """A dataset, and the address that the asker knows this service by, without a closing slash."""

    dataset_id: UUID
    base: str


def facts(access: Access, asked: Asked) -> CardFacts:
    """Return what the card says. Raises DatasetNotFound."""
    with access.snapshot() as mine:
        dataset = mine.get(asked.dataset_id)
        tallies = mine.delivered(asked.dataset_id)
        found = mine.shards_in_trouble(asked.dataset_id, MOST_NAMED + 1)
    troubles = troubles_of(
        [manifest_shard(shard) for shard in found], all_given=len(found) <= MOST_NAMED
    )
    return facts_of(
        manifest_head(dataset, tallies),
        troubles,
        rights_of(dataset.spec, own_places(access.parts, dataset.spec)),
        address=f"{asked.base}/datasets/{asked.dataset_id}",
        hi5_version=hi5_version(),
    )


def rights(access: Access, dataset_id: UUID) -> Rights:
    """Return what may be done with a dataset. Raises DatasetNotFound."""
    with access.snapshot() as mine:
        spec = mine.spec(dataset_id)
    return rights_of(spec, own_places(access.parts, spec))


def distribution(access: Access, asked: Asked) -> Distribution:
    """Return the published files of a dataset of few shards, or where many are listed."""
    with access.snapshot() as mine:
        dataset = mine.get(asked.dataset_id)
        few = sum(dataset.shards_by_status.values()) <= MOST_SHARDS
        done = mine.shards(asked.dataset_id, MOST_SHARDS, status=ShardStatus.DONE) if few else []
    found = [manifest_shard(shard) for shard in done]
    return at_service(asked.base, asked.dataset_id, found, all_given=few)
