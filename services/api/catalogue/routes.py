"""GET the words that specs and labels are made of."""

from fastapi import APIRouter
from pydantic import BaseModel

from hi5_common.domain.spec_schema import spec_json_schema
from hi5_common.domain.vocabulary import KEYPOINTS, SKELETON, VALUES, Attribute, KeypointVisibility

router = APIRouter(prefix="/v1", tags=["catalogue"])


class VocabularyView(BaseModel):
    """Attributes and their values in canonical order; keypoints; bones as pairs of keypoints."""

    attributes: dict[Attribute, list[str]]
    keypoints: list[str]
    skeleton: list[tuple[int, int]]
    visibility: dict[str, int]


@router.get("/vocabulary")
def get_vocabulary() -> VocabularyView:
    """Return every value a spec may name."""
    return VocabularyView(
        attributes={attribute: list(values) for attribute, values in VALUES.items()},
        keypoints=list(KEYPOINTS),
        skeleton=list(SKELETON),
        visibility={state.name.lower(): state.value for state in KeypointVisibility},
    )


@router.get("/spec-schema")
def get_spec_schema() -> dict[str, object]:
    """Return the JSON Schema of a spec."""
    return spec_json_schema()
