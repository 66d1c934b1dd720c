"""Download the published files of a shard, whole or one byte range."""

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Header, Path, Request, Response
from fastapi.responses import StreamingResponse

from hi5_common.domain.errors import Problem
from hi5_common.domain.manifest import ManifestObject
from services.api.access.doors import Reading
from services.api.contract import bytes_of, refused
from services.api.head import ASKED
from services.api.images.routes import CACHE_CONTROL, KNOWN, matches
from services.api.objects import service
from services.api.objects.ranges import ByteRange, Unsatisfiable, parse_range
from services.api.problems import ApiError

router = APIRouter(prefix="/v1/datasets/{dataset_id}/shards", tags=["shards"])

MAX_NUMBER = 2**31 - 1


@router.get(
    "/{number}/objects/{name}",
    response_class=StreamingResponse,
    responses={
        200: bytes_of(*service.MEDIA_TYPES.values()),
        206: {"description": "The range", **bytes_of(*service.MEDIA_TYPES.values())},
        307: {"description": "It is to be read from the store itself, if that is set up"},
        **KNOWN,
        **refused(404, 416),
    },
)
def get_object(
    access: Reading,
    request: Request,
    dataset_id: UUID,
    number: Annotated[int, Path(ge=0, le=MAX_NUMBER)],
    name: Annotated[str, Path(json_schema_extra={"enum": list(service.MEDIA_TYPES)})],
    range_: Annotated[str | None, Header(alias="Range")] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """Stream samples.tar, labels.parquet or members.json; the ETag is the SHA-256.

    Where clients reach the store themselves, the whole file is answered with 307 and an address
    that is good for some minutes; a byte range never is.
    """
    found = service.find_object(access, dataset_id, number, name)
    headers = {
        "ETag": f'"{found.sha256}"',
        "Cache-Control": CACHE_CONTROL,
        "Accept-Ranges": "bytes",
        "Content-Disposition": f'attachment; filename="{number:06d}-{name}"',
    }
    if if_none_match is not None and matches(headers["ETag"], if_none_match):
        return Response(status_code=304, headers=headers)
    store = access.parts.store
    wanted = _wanted(found, range_)
    # Before the first header goes out: later, all that could be done is to break off.
    store.head(found.key)
    signed = service.signed_reads(access.parts.settings)
    if signed is not None and range_ is None and ASKED not in request.scope:
        # Never kept: the address is a credential.
        moved = {"Location": signed.url(found.key), "Cache-Control": "no-store"}
        return Response(status_code=307, headers=moved)
    if wanted is None:
        headers["Content-Length"] = str(found.size_bytes)
        body, status = store.stream(found.key), 200
    else:
        headers["Content-Length"] = str(wanted.stop - wanted.start)
        headers["Content-Range"] = f"bytes {wanted.start}-{wanted.stop - 1}/{found.size_bytes}"
        body, status = service.read_range(store, found.key, wanted), 206
    return StreamingResponse(body, status, headers, service.MEDIA_TYPES[name])


def _wanted(found: ManifestObject, header: str | None) -> ByteRange | None:
    try:
        return parse_range(header, found.size_bytes)
    except Unsatisfiable as error:
        remedy = f"Ask for bytes 0 to {found.size_bytes - 1}."
        raise ApiError(
            416,
            "range",
            "No such range",
            [Problem("Range", header, remedy)],
            headers={"Content-Range": f"bytes */{found.size_bytes}"},
        ) from error
