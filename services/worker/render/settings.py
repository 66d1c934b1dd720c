"""How much path tracing a quality stands for: one table.

Chosen from docs/speed/render.md, which `hi5 bench render` measured: medians of twelve scenes,
inside the hand, in display space, at 640 px and at the 256 px crop that a model trains on.

    draft      1 sample,  OIDN balanced    32.6 dB, 34.0 dB
    standard   3 samples, OIDN balanced    34.9 dB, 36.5 dB
    high      16 samples, OIDN high        37.1 dB, 40.0 dB
    reference 512 samples, no denoiser     unbiased: what the others are compared with

Albedo and normals of so few samples are filtered first, as fast as it goes, before they guide the
denoiser.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from hi5_common.domain.spec import Engine, Quality


class Denoise(StrEnum):
    """Open Image Denoise quality."""

    NONE = "none"
    FAST = "fast"
    BALANCED = "balanced"
    HIGH = "high"


class Prefilter(StrEnum):
    """How the denoiser's albedo and normal guides are cleaned first."""

    NONE = "none"
    FAST = "fast"
    ACCURATE = "accurate"


@dataclass(frozen=True)
class RenderSettings:
    """What the path tracer is told. `samples` per pixel is fixed: no adaptive stop, no clock."""

    samples: int
    denoise: Denoise
    prefilter: Prefilter
    max_bounces: int = 4
    engine: Engine = Engine.CYCLES
    scatter_from_px: float = 1.25
    """Light wanders in the skin where the longest of its mean free paths is so many pixels."""


QUALITY_SETTINGS: Mapping[Quality, RenderSettings] = MappingProxyType(
    {
        Quality.DRAFT: RenderSettings(1, Denoise.BALANCED, Prefilter.FAST),
        Quality.STANDARD: RenderSettings(3, Denoise.BALANCED, Prefilter.FAST),
        Quality.HIGH: RenderSettings(16, Denoise.HIGH, Prefilter.ACCURATE),
        Quality.REFERENCE: RenderSettings(
            512, Denoise.NONE, Prefilter.NONE, max_bounces=12, scatter_from_px=0.0
        ),
    }
)

EEVEE_SETTINGS: Mapping[Quality, RenderSettings] = MappingProxyType(
    {
        quality: RenderSettings(
            samples, Denoise.NONE, Prefilter.NONE, scatter_from_px=0.0, engine=Engine.EEVEE
        )
        for quality, samples in ((Quality.DRAFT, 8), (Quality.STANDARD, 32), (Quality.HIGH, 128))
    }
)
"""EEVEE's samples move the camera within a pixel, and shadows; no bounces are traced."""
