"""GET what the labels that a dataset has delivered say of its balance."""

from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, Depends, Request, Response
from pydantic import BaseModel

from hi5_common.domain.errors import Problem
from hi5_common.fairness.report import Fairness
from services.api.access.doors import Reading
from services.api.audit.service import Audited, audited
from services.api.contract import refused
from services.api.problems import ApiError

router = APIRouter(prefix="/v1/datasets", tags=["audit"])

MEDIA_TYPE = "application/json"
RETRY_AFTER_S = 1


class AuditAwaited(BaseModel):
    """An audit is being made. Ask again after the seconds that Retry-After says."""

    status: Literal["being made"] = "being made"


def _max_images(request: Request) -> int:
    limit: int = request.app.state.max_audit_images
    return limit


MaxImages = Annotated[int, Depends(_max_images)]


@router.get(
    "/{dataset_id}/audit",
    response_model=Fairness,
    responses={202: {"model": AuditAwaited}, **refused(404, 409)},
)
def get_audit(access: Reading, dataset_id: UUID, max_images: MaxImages) -> Response:
    """Audit delivered labels, not pictures: the audit.json of `hi5 audit --no-pixels`.

    202 while it is made. Of a dataset that is still being rendered, the audit is of what was
    delivered when it was made.
    """
    found = audited(access, dataset_id, max_images)
    if found.too_many:
        raise _too_many(found)
    # Written here, on the request's own thread: megabytes would hold up all others on the loop's.
    if found.report is not None:
        return Response(found.report.model_dump_json(), media_type=MEDIA_TYPE)
    headers = {"Retry-After": str(RETRY_AFTER_S)}
    return Response(AuditAwaited().model_dump_json(), 202, headers, MEDIA_TYPE)


def _too_many(found: Audited) -> ApiError:
    remedy = (
        f"The service audits at most {found.max_images:,} delivered images "
        f"(HI5_API_MAX_AUDIT_IMAGES). Run: {found.command} --no-pixels"
    )
    problem = Problem("images", found.dataset.images_done, remedy)
    return ApiError(409, "too-many-images", "Too many images to audit here", [problem])
