"""How many samples an image needs: predicted from its scene, by a table that was measured.

`hi5 bench calibrate` renders scenes with growing samples, and fits
    log10 (mean squared error) = Σ error[f] · f        for the features of `error_features`,
    seconds                    = Σ time[f] · f         for those of `time_features`.
The error's part holds for every machine; the seconds hold for machines of its kind.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from hi5_common.domain.errors import InvalidInput, Problem
from hi5_common.domain.spec import Engine, RenderRequest
from services.worker.label.projected import ProjectedMesh
from services.worker.render.detail import path_px
from services.worker.render.rect import PixelRect
from services.worker.render.settings import (
    EEVEE_SETTINGS,
    QUALITY_SETTINGS,
    Denoise,
    Prefilter,
    RenderSettings,
)
from services.worker.scene.environments import LUMINANCE
from services.worker.scene.exposure import lamps_of
from services.worker.scene.types import HandScene, SceneGeometry

SAMPLES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512)
"""What an image may get: steps of about the root of two."""
DENOISE, PREFILTER = Denoise.BALANCED, Prefilter.FAST
"""The denoiser that the table is measured with."""


@dataclass(frozen=True)
class Features:
    """What error and time depend on, known before anything is rendered.

    concentration: 1 where one lamp gives all light, 1/N where N patches of sky give alike.
    albedo: luminance of the back of the hand. hand_px counts pixels of surfaces that face the
    camera, one behind another too; region_px those that are traced. path_px: the longest mean free
    path of light in the skin.
    """

    concentration: float
    albedo: float
    hand_px: float
    region_px: int
    path_px: float

    @classmethod
    def of(
        cls, scene: HandScene, geometry: SceneGeometry, mesh: ProjectedMesh, region: PixelRect
    ) -> "Features":
        """Read them off a scene."""
        power = lamps_of(scene.light.environment).irradiance
        concentration = float((power**2).sum() / power.sum() ** 2) if power.size else 1.0
        return cls(
            concentration,
            float(np.dot(scene.skin.dorsum_rgb, LUMINANCE)),
            _facing_px(mesh, region),
            region.width * region.height,
            path_px(scene, geometry),
        )


class Calibration(BaseModel):
    """A measured table. spread: standard deviation of log10 of the squared error about the fit."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    machine: dict[str, str | int | float]
    error: dict[str, float]
    spread: float
    time: dict[str, float]

    def error_at(self, features: Features, samples: int) -> float:
        """Return the predicted root mean squared error in the hand, display values."""
        return math.pow(10.0, 0.5 * _sum(self.error, error_features(features, samples)))

    def seconds_at(self, features: Features, samples: int) -> float:
        """Return the predicted time of an image."""
        return _sum(self.time, time_features(features, samples))

    def safe_error_at(self, features: Features, samples: int) -> float:
        """Return the error that five images in six are predicted to stay under."""
        return self.error_at(features, samples) * math.pow(10.0, 0.5 * self.spread)


@dataclass(frozen=True)
class Choice:
    """The settings of an image, and what was predicted of them: error and seconds.

    Nothing is predicted for a quality: its settings are what they are.
    """

    settings: RenderSettings
    calibration: str | None = None
    predicted_error: float | None = None
    predicted_s: float | None = None


def choose(asked: RenderRequest, features_of: Callable[[], Features], table: Calibration) -> Choice:
    """Return the settings of an image; its features are read only if something is predicted.

    For max_error the fewest samples that keep the error in five images of six; for
    seconds_per_image the most that fit, and one where none do. Beyond the most there are, the most.
    """
    if asked.quality is not None:
        eevee = asked.engine is Engine.EEVEE
        return Choice((EEVEE_SETTINGS if eevee else QUALITY_SETTINGS)[asked.quality])
    features = features_of()
    if asked.max_error is not None:
        bound = asked.max_error
        samples = next(
            (n for n in SAMPLES if table.safe_error_at(features, n) <= bound), SAMPLES[-1]
        )
    else:
        seconds = asked.seconds_per_image or 0.0
        fitting = [n for n in SAMPLES if table.seconds_at(features, n) <= seconds]
        samples = max(fitting, default=SAMPLES[0])
    return Choice(
        RenderSettings(samples, DENOISE, PREFILTER),
        table.name,
        round(table.safe_error_at(features, samples), 5),
        round(table.seconds_at(features, samples), 3),
    )


def error_features(features: Features, samples: int) -> Mapping[str, float]:
    """Return the terms of the logarithm of the squared error."""
    doublings = math.log2(samples)
    return {
        "one": 1.0,
        "doublings": doublings,
        "doublings_squared": doublings**2,
        "concentration": math.log10(max(features.concentration, 1e-6)),
        "albedo": math.log10(max(features.albedo, 1e-3)),
        "hand_px": math.log10(max(features.hand_px, 1.0)),
    }


def time_features(features: Features, samples: int) -> Mapping[str, float]:
    """Return the terms of the seconds."""
    return {
        "one": 1.0,
        "hand_megasamples": features.hand_px * samples / 1e6,
        "wandering_megasamples": features.hand_px * samples / 1e6 * _wanders(features),
        "region_megasamples": features.region_px * samples / 1e6,
        "region_megapixels": features.region_px / 1e6,
    }


@cache
def shipped() -> Calibration:
    """Return the table that comes with hi5."""
    text = files("services.worker.render").joinpath("calibration.json").read_text("utf-8")
    return Calibration.model_validate_json(text)


def read_calibration(path: Path) -> Calibration:
    """Read a table that `hi5 bench calibrate` wrote. Raises InvalidInput."""
    try:
        return Calibration.model_validate(json.loads(path.read_text("utf-8")))
    except (OSError, ValueError, ValidationError) as error:
        remedy = f"Name a file that `hi5 bench calibrate` wrote ({str(error).splitlines()[0]})."
        raise InvalidInput([Problem("HI5_CALIBRATION", str(path), remedy)]) from error


def _wanders(features: Features) -> bool:
    return features.path_px >= RenderSettings(1, DENOISE, PREFILTER).scatter_from_px


def _facing_px(mesh: ProjectedMesh, region: PixelRect) -> float:
    """Return the area in pixels of triangles that face the camera and lie in the region."""
    corners = mesh.corners_px
    (x, y) = (corners[:, 0] + corners[:, 1] + corners[:, 2]).T / 3.0
    inside = (x >= region.left) & (x <= region.right) & (y >= region.top) & (y <= region.bottom)
    first, second = (corners[inside, k] - corners[inside, 0] for k in (1, 2))
    doubled = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    # With y down, what turns clockwise on paper faces the camera.
    return float(-np.minimum(doubled, 0.0).sum() / 2.0)


def _sum(weights: Mapping[str, float], terms: Mapping[str, float]) -> float:
    return sum(weight * terms[name] for name, weight in weights.items())
