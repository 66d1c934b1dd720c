"""Which delivered images a page shows, and what is on them."""

from collections.abc import Mapping
from dataclasses import dataclass
from uuid import UUID

from hi5_common.domain.plan import Plan
from hi5_common.domain.records import ShardStatus
from hi5_common.domain.sharding import shard_number
from hi5_common.domain.vocabulary import Attribute
from services.api.access.access import Access

IMAGES_PER_PAGE = 24


@dataclass(frozen=True)
class Picture:
    """A delivered image and its cell."""

    index: int
    attributes: Mapping[Attribute, str]


@dataclass(frozen=True)
class Gallery:
    """Some delivered images in order of index; `next_index` is the first of the next page."""

    first_index: int
    pictures: tuple[Picture, ...]
    next_index: int | None


def gallery(access: Access, dataset_id: UUID, plan: Plan, first_index: int) -> Gallery:
    """Return the delivered images from `first_index` on."""
    wanted = IMAGES_PER_PAGE + 1  # one more tells whether there is a next page
    found: list[int] = []
    after = shard_number(plan.spec, first_index) - 1
    with access.snapshot() as mine:
        while len(found) < wanted:
            done = mine.shards(
                dataset_id,
                wanted,
                after if after >= 0 else None,
                status=ShardStatus.DONE,
            )
            for shard in done:
                found += [index for index in shard.images() if index >= first_index][:wanted]
            if len(done) < wanted:
                break
            after = done[-1].number
    shown = found[:IMAGES_PER_PAGE]
    following = found[IMAGES_PER_PAGE] if len(found) > IMAGES_PER_PAGE else None
    pictures = tuple(Picture(index, plan.cell(index).as_dict()) for index in shown)
    return Gallery(first_index, pictures, following)
