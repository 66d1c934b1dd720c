"""One image, or its label, out of a published shard."""

from dataclasses import dataclass
from uuid import UUID

from hi5_common.domain.errors import Problem
from hi5_common.domain.records import Publication, Shard, ShardStatus
from services.api.access.access import Access
from services.api.images.members import Member
from services.api.problems import ApiError

MEDIA_TYPES = {".jpg": "image/jpeg", ".png": "image/png"}
LABEL_SUFFIX = ".json"

_REMEDIES = {
    ShardStatus.PENDING: "Wait: no worker has taken it yet.",
    ShardStatus.LEASED: "Wait: a worker renders it now.",
    ShardStatus.FAILED: "POST to the dataset's /retry to have it rendered again.",
    ShardStatus.CANCELLED: "The dataset was cancelled: submit the spec again for its images.",
}


@dataclass(frozen=True)
class Found:
    """A member of a published shard, not read yet."""

    publication: Publication
    member: Member
    media_type: str


def find_image(access: Access, dataset_id: UUID, index: int) -> Found:
    """Locate the picture of image `index`. Raises DatasetNotFound, ImageNotFound, ApiError 404."""
    publication = _publication(access, dataset_id, index)
    members = access.parts.members.of(publication)
    for suffix, media_type in MEDIA_TYPES.items():
        if member := members.get(f"{index:09d}{suffix}"):
            return Found(publication, member, media_type)
    raise _not_there(publication, index)


def find_label(access: Access, dataset_id: UUID, index: int) -> Found:
    """Locate the label of image `index`; raises as find_image does."""
    publication = _publication(access, dataset_id, index)
    member = access.parts.members.of(publication).get(f"{index:09d}{LABEL_SUFFIX}")
    if member is None:
        raise _not_there(publication, index)
    return Found(publication, member, "application/json")


def _not_there(publication: Publication, index: int) -> Exception:
    """Return the 404 of a gap, or the error of a shard that lacks what it ought to have."""
    for gap in publication.gaps:
        if gap.index == index:
            detail = f"Image {index} could not be made and was left out: it {gap.reason[:500]}."
            remedy = "Take another image: the dataset is complete without this one."
            problem = Problem("index", index, remedy)
            return ApiError(404, "image-missing", "Image missing", [problem], detail)
    return LookupError(f"image {index} is not in {publication.members.key}")


def _publication(access: Access, dataset_id: UUID, index: int) -> Publication:
    with access.snapshot() as mine:
        shard = mine.shard_of_image(dataset_id, index)
    return published(shard, Problem("index", index, ""))


def published(shard: Shard, asked: Problem) -> Publication:
    """Return what a shard published, or raise the 404 that says how far it is instead."""
    if shard.publication is not None:
        return shard.publication
    reason = f" ({shard.failure_reason})" if shard.failure_reason else ""
    remedy = f"Shard {shard.number} is {shard.status}{reason}. {_REMEDIES[shard.status]}"
    problem = Problem(asked.field, asked.value, remedy)
    detail = f"Shard {shard.number} is {shard.status}: it has delivered nothing yet."
    raise ApiError(404, "not-delivered", "Not delivered yet", [problem], detail)
