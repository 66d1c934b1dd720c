"""Shards by status on a page: counts, and the ones that failed or are being rendered."""

from dataclasses import dataclass
from uuid import UUID

from hi5_common.domain.records import Shard, ShardStatus
from services.api.access.access import Access

SHOWN_PER_STATUS = 12


@dataclass(frozen=True)
class ShardBoard:
    """The first shards of the states that somebody may want to act on."""

    failed: tuple[Shard, ...]
    leased: tuple[Shard, ...]
    retried: tuple[Shard, ...]


def shard_board(access: Access, dataset_id: UUID) -> ShardBoard:
    """Return failed shards, leased ones, and pending ones that failed before."""
    with access.snapshot() as mine:
        by_status = {
            status: mine.shards(dataset_id, SHOWN_PER_STATUS, status=status)
            for status in (ShardStatus.FAILED, ShardStatus.LEASED, ShardStatus.PENDING)
        }
    retried = [shard for shard in by_status[ShardStatus.PENDING] if shard.failure_reason]
    return ShardBoard(
        tuple(by_status[ShardStatus.FAILED]),
        tuple(by_status[ShardStatus.LEASED]),
        tuple(retried),
    )
