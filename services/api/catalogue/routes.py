"""GET the words that specs and labels are made of."""

from fastapi import APIRouter, Depends
from pydantic import BaseModel

from hi5_common.domain.affect import POSE_AFFECT
from hi5_common.domain.environments import CATALOGUE, EnvironmentKind, EnvironmentOrigin
from hi5_common.domain.light import LightLevel, light_level
from hi5_common.domain.spec import DatasetSpec
from hi5_common.domain.spec_schema import spec_json_schema
from hi5_common.domain.tags import PREFIX, TAGS
from hi5_common.domain.vocabulary import (
    DEFAULTS,
    ITA_RANGE_DEG,
    KEYPOINTS,
    SHAPE_RANGES,
    SKELETON,
    SKIN_TONE_ITA_DEG,
    VALUES,
    Attribute,
    KeypointVisibility,
    Pose,
    SkinTone,
)
from hi5_common.presets import NAMES, preset
from services.api.access.doors import reading

router = APIRouter(prefix="/v1", tags=["catalogue"], dependencies=[Depends(reading)])


class ShapeView(BaseModel):
    """The human range of a shape factor: a spec names numbers in it, or bands low..high."""

    low: float
    high: float
    average: float
    unit: str


class EnvironmentView(BaseModel):
    """A built-in environment; luminance is the mean over the sphere in its own units."""

    title: str
    kind: EnvironmentKind
    origin: EnvironmentOrigin
    source: str
    author: str
    licence: str
    luminance: float
    light_level: LightLevel


class VocabularyView(BaseModel):
    """Attributes and their values in canonical order, and what a spec that leaves one out gets;
    what values mean; what tags stand for; keypoints; bones as pairs of keypoints.
    """

    attributes: dict[Attribute, list[str]]
    defaults: dict[Attribute, list[str]]
    skin_tone_ita_deg: dict[SkinTone, float]
    ita_range_deg: tuple[float, float]
    shapes: dict[Attribute, ShapeView]
    environments: dict[str, EnvironmentView]
    environment_tags: dict[str, list[str]]
    affect: dict[Pose, str]
    keypoints: list[str]
    skeleton: list[tuple[int, int]]
    visibility: dict[str, int]


@router.get("/vocabulary")
def get_vocabulary() -> VocabularyView:
    """Return every value a spec may name."""
    return VocabularyView(
        attributes={attribute: list(values) for attribute, values in VALUES.items()},
        defaults={attribute: list(values) for attribute, values in DEFAULTS.items()},
        skin_tone_ita_deg=dict(SKIN_TONE_ITA_DEG),
        ita_range_deg=ITA_RANGE_DEG,
        shapes={
            attribute: ShapeView(
                low=found.low, high=found.high, average=found.average, unit=found.unit
            )
            for attribute, found in SHAPE_RANGES.items()
        },
        environments={
            name: EnvironmentView(
                title=entry.title,
                kind=entry.kind,
                origin=entry.origin,
                source=entry.source,
                author=entry.author,
                licence=entry.licence,
                luminance=entry.luminance,
                light_level=light_level(entry.luminance),
            )
            for name, entry in CATALOGUE.items()
        },
        environment_tags={f"{PREFIX}{tag}": list(names) for tag, names in TAGS.items()},
        affect=dict(POSE_AFFECT),
        keypoints=list(KEYPOINTS),
        skeleton=list(SKELETON),
        visibility={state.name.lower(): state.value for state in KeypointVisibility},
    )


@router.get("/presets")
def get_presets() -> dict[str, DatasetSpec]:
    """Return the specs that come with hi5, by name, the smallest first."""
    return {name: preset(name) for name in NAMES}


@router.get("/spec-schema")
def get_spec_schema() -> dict[str, object]:
    """Return the JSON Schema of a spec."""
    return spec_json_schema()
