"""GET the bytes of one image or of its label."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Header, Path, Response

from hi5_common.domain.strict import MAX_COUNT
from services.api.access.doors import Reading
from services.api.contract import Answers, bytes_of, refused
from services.api.images import service
from services.api.images.service import Found
from services.api.parts import Parts

router = APIRouter(prefix="/v1/datasets/{dataset_id}/images", tags=["images"])

Index = Annotated[int, Path(ge=0, lt=MAX_COUNT)]
IfNoneMatch = Annotated[str | None, Header()]

KNOWN: Answers = {304: {"description": "The client has it already"}}

# An index means the same bytes for ever, but a dataset can be deleted.
CACHE_CONTROL = "private, max-age=86400, immutable"


@router.get(
    "/{index}",
    response_class=Response,
    responses={200: bytes_of(*service.MEDIA_TYPES.values()), **KNOWN, **refused(404, 502)},
)
def get_image(
    access: Reading, dataset_id: UUID, index: Index, if_none_match: IfNoneMatch = None
) -> Response:
    """Return the picture as it was rendered; its ETag is its SHA-256."""
    return _answer(access.parts, service.find_image(access, dataset_id, index), if_none_match)


@router.get(
    "/{index}/labels",
    response_class=Response,
    responses={200: {"content": {"application/json": {}}}, **KNOWN, **refused(404, 502)},
)
def get_labels(
    access: Reading, dataset_id: UUID, index: Index, if_none_match: IfNoneMatch = None
) -> Response:
    """Return the label, byte for byte as stored."""
    return _answer(access.parts, service.find_label(access, dataset_id, index), if_none_match)


def _answer(parts: Parts, found: Found, if_none_match: str | None) -> Response:
    etag = f'"{found.member.sha256}"'
    headers = {"ETag": etag, "Cache-Control": CACHE_CONTROL}
    if if_none_match is not None and matches(etag, if_none_match):
        return Response(status_code=304, headers=headers)
    content = parts.members.bytes_of(found.publication, found.member)
    return Response(content, headers=headers, media_type=found.media_type)


def matches(etag: str, if_none_match: str) -> bool:
    """Say whether a client already has this entity (RFC 9110, 13.1.2: weak comparison)."""
    known = {tag.strip().removeprefix("W/") for tag in if_none_match.split(",")}
    return etag in known or "*" in known
