"""GET a dataset's card: for people, for machines, for whoever asks what is allowed."""

import json
from uuid import UUID

from fastapi import APIRouter, Request, Response

from hi5_common.cards.croissant import MEDIA_TYPE, croissant
from hi5_common.cards.datasheet import datasheet
from hi5_common.domain.rights import Rights
from services.api.access.doors import Reading
from services.api.cards import service
from services.api.cards.service import Asked
from services.api.contract import bytes_of, refused

router = APIRouter(prefix="/v1/datasets", tags=["cards"])

MARKDOWN = "text/markdown; charset=utf-8"


@router.get(
    "/{dataset_id}/card",
    response_class=Response,
    responses={200: bytes_of("text/markdown"), **refused(404, 502)},
)
def get_card(access: Reading, request: Request, dataset_id: UUID) -> Response:
    """Return the datasheet as Markdown."""
    facts = service.facts(access, _asked(request, dataset_id))
    return Response(datasheet(facts), media_type=MARKDOWN)


@router.get(
    "/{dataset_id}/croissant",
    response_class=Response,
    responses={200: bytes_of(MEDIA_TYPE), **refused(404, 502)},
)
def get_croissant(access: Reading, request: Request, dataset_id: UUID) -> Response:
    """Return Croissant 1.1 with its RAI fields. Files of many shards are left to the manifest."""
    asked = _asked(request, dataset_id)
    document = croissant(service.facts(access, asked), service.distribution(access, asked))
    return Response(json.dumps(document, indent=1, ensure_ascii=False), media_type=MEDIA_TYPE)


@router.get("/{dataset_id}/licences", responses=refused(404))
def get_licences(access: Reading, dataset_id: UUID) -> Rights:
    """Return every asset of a dataset with its licence, and what they allow together."""
    return service.rights(access, dataset_id)


def _asked(request: Request, dataset_id: UUID) -> Asked:
    return Asked(dataset_id, str(request.base_url).rstrip("/"))
