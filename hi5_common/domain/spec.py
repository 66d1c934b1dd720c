"""The dataset spec: what a researcher asks for. One model for the API, the CLI and Python."""

import json
import math
from collections.abc import Hashable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import Self

import pydantic
import yaml
from pydantic import Field

from hi5_common.domain import (
    clashes,
    distributions,
    growth,
    spec_errors,
    splits,
    tag_reading,
    twins,
)
from hi5_common.domain.assets import commercial_problems, may_be_traded
from hi5_common.domain.conditions import MAX_CONDITIONS, Combination, Conditional, Coverage
from hi5_common.domain.distributions import AskedDistribution
from hi5_common.domain.environments import CATALOGUE
from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.shares import whole_shares
from hi5_common.domain.spec_errors import ProblemsFound
from hi5_common.domain.splits import Splits
from hi5_common.domain.strict import MAX_COUNT, StrictModel, Weights
from hi5_common.domain.values import in_order, spelled
from hi5_common.domain.vocabulary import ALWAYS_BALANCED, DEFAULTS, Attribute

MAX_SIDE_PX = 8192
MAX_ASKED_SHARDS = 100_000

LATER = (
    "twins",
    "splits",
    "extends",
    "commercial_safe",
    "conditional",
    "coverage",
    "distributions",
)
"""Fields that earlier versions did not know."""
QUALITY_WAYS = ("quality", "max_error", "seconds_per_image")
"""The fields of `render` that say how many samples an image gets."""


Request = list[str] | dict[str, int] | Weights | None
"""Nothing: every value in equal shares. A list: equal shares. A map: exact counts, or weights."""


class ImageFormat(StrEnum):
    """How pictures are encoded."""

    JPEG = "jpeg"
    PNG = "png"


class Quality(StrEnum):
    """How much path tracing an image gets."""

    DRAFT = "draft"
    STANDARD = "standard"
    HIGH = "high"
    REFERENCE = "reference"


class Engine(StrEnum):
    """What draws: Cycles traces paths; EEVEE rasterises, in a fraction of the time on a GPU."""

    CYCLES = "cycles"
    EEVEE = "eevee"


class LabelKind(StrEnum):
    """Which labels to write; camera, attributes and scene are always there."""

    KEYPOINTS = "keypoints"
    BOX = "box"
    MASK = "mask"


class ImageRequest(StrictModel):
    """The picture: size in pixels, file format, JPEG quality (4:4:4 chroma always)."""

    width: int = Field(640, ge=16, le=MAX_SIDE_PX, strict=True)
    height: int = Field(640, ge=16, le=MAX_SIDE_PX, strict=True)
    format: ImageFormat = ImageFormat.JPEG
    jpeg_quality: int = Field(95, ge=1, le=100, strict=True)


class RenderRequest(StrictModel):
    """How the picture is rendered: by a quality, or as many samples as an error or a time takes.

    max_error: root of the mean squared error inside the hand, in display values 0..1, that each
    image is predicted to keep (0.02 is 34 dB). seconds_per_image: predicted for the machine of the
    calibration, not measured on the one that renders: an image stays a function of its spec.
    Just one of the three is set; quality is standard where none was asked for. EEVEE takes a
    quality, reference excepted: errors and times are predicted of path tracing.
    """

    engine: Engine = Engine.CYCLES

    quality: Quality | None = None
    max_error: float | None = Field(None, ge=0.003, le=0.2, allow_inf_nan=False)
    seconds_per_image: float | None = Field(None, ge=0.05, le=3600, allow_inf_nan=False)

    @pydantic.model_validator(mode="before")
    @classmethod
    def _just_one(cls, asked: object) -> object:
        if not isinstance(asked, Mapping):
            return asked
        named = [way for way in QUALITY_WAYS if asked.get(way) is not None]
        if len(named) > 1:
            remedy = f"Name one of {', '.join(QUALITY_WAYS)}."
            raise ProblemsFound([Problem("render", " and ".join(named), remedy)])
        return dict(asked) if named else {**asked, "quality": Quality.STANDARD}

    @pydantic.model_validator(mode="after")
    def _eevee_takes_a_quality(self) -> Self:
        if self.engine is Engine.EEVEE and self.quality in {None, Quality.REFERENCE}:
            way = next(way for way in QUALITY_WAYS if getattr(self, way) is not None)
            value = getattr(self, way)
            remedy = "Use engine: cycles, or with eevee quality: draft, standard or high."
            raise ProblemsFound([Problem(f"render.{way}", str(value), remedy)])
        return self


class AttributeRequests(StrictModel):
    """For each attribute: nothing (all values), a list (equal shares), a map of exact counts, or
    {weights: map} for shares in any unit.
    """

    gender: Request = None
    skin_tone: Request = None
    pose: Request = None
    environment: Request = None
    handedness: Request = None
    viewpoint: Request = None
    age: Request = None
    weight: Request = None
    muscle: Request = None
    finger_length: Request = None
    finger_thickness: Request = None
    hand_scale: Request = None
    ring: Request = None
    wrist_wear: Request = None
    nail_polish: Request = None
    sleeve: Request = None

    @pydantic.field_validator("*", mode="before")
    @classmethod
    def _spell(cls, request: object, info: pydantic.ValidationInfo) -> object:
        """Give each value its one spelling; `DatasetSpec` then refuses those there are not."""
        attribute = Attribute(str(info.field_name))
        problems = spec_errors.shape_problems(attribute, request)
        if problems:
            raise ProblemsFound(problems)
        if isinstance(request, dict):
            weights = request.get("weights")
            if isinstance(weights, dict):
                return {"weights": {spelled(attribute, v): n for v, n in weights.items()}}
            return {spelled(attribute, value): count for value, count in request.items()}
        if isinstance(request, list):
            return [spelled(attribute, value) for value in request]
        return request

    def __getitem__(self, attribute: Attribute) -> Request:
        request: Request = getattr(self, attribute.value)
        return request


class DatasetSpec(StrictModel):
    """A dataset: images are a pure function of this spec, its seed and their index."""

    name: str = Field(
        "dataset", min_length=1, max_length=100, pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]*$"
    )
    seed: int = Field(0, ge=0, lt=2**63, strict=True)
    count: int = Field(ge=1, le=MAX_COUNT, strict=True)
    attributes: AttributeRequests = AttributeRequests()
    combinations: list[Combination] = Field(default=[], max_length=MAX_CONDITIONS)
    conditional: list[Conditional] = Field(default=[], max_length=MAX_CONDITIONS)
    coverage: list[Coverage] = Field(default=[], max_length=MAX_CONDITIONS)
    distributions: dict[Attribute, AskedDistribution] = Field(default={})
    twins: list[Attribute] = Field(default=[], max_length=len(twins.TWINNED))
    splits: Splits | None = None
    extends: "DatasetSpec | None" = None
    image: ImageRequest = ImageRequest()
    render: RenderRequest = RenderRequest()
    labels: list[LabelKind] = Field(default=list(LabelKind), min_length=1)
    images_per_shard: int | None = Field(None, ge=1, le=10_000, strict=True)
    commercial_safe: bool = Field(False, strict=True)
    """Refuse whatever may not be used commercially; see `rights.py` for panoramas of one's own."""

    @pydantic.model_validator(mode="before")
    @classmethod
    def _read_tags(cls, asked: object) -> object:
        if not isinstance(asked, Mapping):
            return asked
        found, problems = tag_reading.resolved(asked)
        if problems:
            raise ProblemsFound(problems)
        return found

    @pydantic.model_validator(mode="after")
    def _check_values_and_counts(self) -> Self:
        problems = [
            problem
            for attribute in Attribute
            for problem in spec_errors.request_problems(
                attribute, _named(self.attributes[attribute]), self.count
            )
        ]
        if not problems:
            problems += twins.problems(self)
        if not problems:
            problems += growth.problems(self) or splits.problems(self)
        if self.commercial_safe:
            named = self.values_of(Attribute.ENVIRONMENT)
            problems += commercial_problems((v for v in named if v in CATALOGUE), {})
        if not problems:
            problems += clashes.problems(self) + distributions.problems(self)
        problems += spec_errors.repeated("labels", [kind.value for kind in self.labels])
        if self.images_per_shard and self.count > self.images_per_shard * MAX_ASKED_SHARDS:
            least = -(-self.count // MAX_ASKED_SHARDS)
            remedy = f"That makes over {MAX_ASKED_SHARDS} shards: ask for {least} or leave it out."
            problems.append(Problem("images_per_shard", self.images_per_shard, remedy))
        if problems:
            raise ProblemsFound(problems)
        return self

    def values_of(self, attribute: Attribute) -> tuple[str, ...]:
        """Return the values asked for, in canonical order, those of no images included."""
        named = _named(self.attributes[attribute])
        if named is not None:
            return tuple(in_order(attribute, named))
        if self.commercial_safe and attribute is Attribute.ENVIRONMENT:
            return tuple(filter(may_be_traded, DEFAULTS[attribute]))
        return DEFAULTS[attribute]

    def counts_of(self, attribute: Attribute) -> dict[str, int] | None:
        """Return the images of each value, in canonical order; None where shares are equal."""
        request = self.attributes[attribute]
        if isinstance(request, Weights):
            weights = {value: request.weights[value] for value in self.values_of(attribute)}
            each = self.images_per_scene
            return {v: each * n for v, n in whole_shares(weights, self.count // each).items()}
        if isinstance(request, dict):
            return {value: request[value] for value in self.values_of(attribute)}
        return None

    def balanced(self) -> tuple[Attribute, ...]:
        """Return the attributes that tables cross: the first six, and others with a choice."""
        return tuple(
            attribute
            for attribute in Attribute
            if attribute in ALWAYS_BALANCED or len(self.values_of(attribute)) > 1
        )

    def twinned(self) -> tuple[Attribute, ...]:
        """Return what twins differ in, in planning order."""
        return tuple(attribute for attribute in Attribute if attribute in self.twins)

    @property
    def images_per_scene(self) -> int:
        """Return how many images show the same scene: more than one of twins."""
        return math.prod(len(self.values_of(attribute)) for attribute in self.twins)

    def canonical_json(self) -> str:
        """Return the spec as JSON with sorted keys: the same spec always gives the same text.

        What came later and is not asked for is left out: the text of older specs stays as it was.
        """
        unset = {name for name in LATER if not getattr(self, name)}
        document = self.model_dump(mode="json", exclude=unset)
        return json.dumps(document, sort_keys=True, separators=(",", ":"))


def _named(request: Request) -> list[str] | dict[str, int] | None:
    """Return a request without its weights: what values it names."""
    return list(request.weights) if isinstance(request, Weights) else request


def parse_spec(document: object) -> DatasetSpec:
    """Validate a decoded YAML or JSON document; raise InvalidInput with every problem in it."""
    if not isinstance(document, Mapping):
        remedy = "Send a mapping, for example {count: 24}."
        raise InvalidInput([Problem("spec", document, remedy)])
    try:
        return DatasetSpec.model_validate(document)
    except pydantic.ValidationError as error:
        problems = spec_errors.from_pydantic(error, DatasetSpec)
        raise InvalidInput(problems) from error


def parse_spec_text(text: str) -> DatasetSpec:
    """Parse YAML, of which JSON is a part."""
    try:
        document = yaml.load(text, Loader=_UniqueKeyLoader)  # noqa: S506  it is a SafeLoader
    except (yaml.YAMLError, RecursionError, ValueError) as error:  # ValueError: no such date
        remedy = "Write YAML or JSON; the first error is at the place named."
        raise InvalidInput([Problem("spec", str(error), remedy)]) from error
    return parse_spec(document)


def load_spec(path: Path) -> DatasetSpec:
    """Read and parse a spec file."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        remedy = "Name a readable UTF-8 YAML or JSON file."
        raise InvalidInput([Problem("spec", f"{path}: {error}", remedy)]) from error
    return parse_spec_text(text)


class _UniqueKeyLoader(yaml.SafeLoader):
    """SafeLoader that refuses a key written twice (YAML would silently keep the last)."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[object, object]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        seen: set[object] = set()
        for key in keys:
            if isinstance(key, Hashable) and key in seen:
                raise yaml.YAMLError(f"key {key!r} is written twice{node.start_mark}")
            if isinstance(key, Hashable):
                seen.add(key)
        mapping: dict[object, object] = super().construct_mapping(node, deep)
        return mapping
