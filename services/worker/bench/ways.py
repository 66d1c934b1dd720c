"""The ways of rendering that are compared: how many samples, which denoiser, what is left out."""

from dataclasses import dataclass, replace

from hi5_common.domain.spec import Quality
from services.worker.render import calibration
from services.worker.render.settings import QUALITY_SETTINGS, Denoise, Prefilter, RenderSettings

ADAPTIVE = (
    ("use_adaptive_sampling", True),
    ("adaptive_threshold", 0.1),
    ("adaptive_min_samples", 4),
)
PLAIN_PATTERN = (("sampling_pattern", "TABULATED_SOBOL"),)
"""Blender's own default."""
IMPORTANCE_MAP_PX = 512
"""As the renderer's own; the renderer is not imported, for it loads Blender."""


@dataclass(frozen=True)
class Way:
    """One way. `crop` renders the hand's rectangle only; `persistent` keeps Blender's scene."""

    name: str
    settings: RenderSettings
    crop: bool = True
    persistent: bool = True
    group: str = "front"
    importance_map_px: int = IMPORTANCE_MAP_PX
    clamp_white: tuple[float, float] | None = None
    """Direct and indirect light of a sample, at most so many times white; None: the renderer's."""
    ahead: bool = True
    """Stage the next image while this one renders."""
    outline: bool = True
    """Take the hand's coverage of pixels from its mesh; else as the samples have it."""
    properties: tuple[tuple[str, object], ...] = ()
    """Cycles properties beside those of the settings."""


STANDARD = QUALITY_SETTINGS[Quality.STANDARD]
STRAIGHTFORWARD = RenderSettings(
    16, Denoise.HIGH, Prefilter.ACCURATE, max_bounces=12, scatter_from_px=0.0
)
"""Full frame, nothing kept, twelve bounces, the best denoiser: what one writes first."""


ESSENTIAL = (
    "full frame instead of the hand's rectangle",
    "light wanders in any skin",
    "denoiser fast",
    "prefilter accurate",
    "no denoiser",
    "outline as sampled",
    "next image not staged ahead",
)
"""The ablations that say most: those with a price in time or in error."""


def front(samples: tuple[int, ...], essential: bool = False) -> list[Way]:
    """Return the ways among which presets are chosen: denoisers by samples.

    essential: the three denoisers between which the choice lies.
    """
    denoisers = (
        (Denoise.NONE, Prefilter.NONE),
        (Denoise.FAST, Prefilter.FAST),
        (Denoise.HIGH, Prefilter.ACCURATE),
    )
    others = (
        (Denoise.BALANCED, Prefilter.FAST),
        (Denoise.BALANCED, Prefilter.NONE),
        (Denoise.HIGH, Prefilter.NONE),
        (Denoise.HIGH, Prefilter.FAST),
    )
    return [
        Way(_name(settings), settings)
        for denoise, prefilter in (*denoisers, *(() if essential else others))
        for count in samples
        for settings in (RenderSettings(count, denoise, prefilter),)
    ]


def balanced(samples: tuple[int, ...]) -> list[Way]:
    """Return the ways that a calibration is fitted to: its denoiser by samples."""
    return [
        Way(_name(settings), settings)
        for count in samples
        for settings in (RenderSettings(count, calibration.DENOISE, calibration.PREFILTER),)
    ]


def presets() -> list[Way]:
    """Return the presets that stop after seconds: all but the reference."""
    return [
        Way(quality.value, QUALITY_SETTINGS[quality], group="preset")
        for quality in (Quality.DRAFT, Quality.STANDARD, Quality.HIGH)
    ]


def straightforward(samples: tuple[int, ...]) -> list[Way]:
    """Return the straightforward way with each number of samples."""
    return [
        Way(
            f"straightforward {count}",
            replace(STRAIGHTFORWARD, samples=count),
            crop=False,
            persistent=False,
            ahead=False,
            outline=False,
            properties=PLAIN_PATTERN,
            group="straightforward",
        )
        for count in samples
    ]


def ablations(essential: bool = False) -> list[Way]:
    """Return the standard preset with one saving at a time taken back, or one more tried.

    essential: those named in ESSENTIAL.
    """
    without: dict[str, Way] = {
        "full frame instead of the hand's rectangle": Way("", STANDARD, crop=False),
        "no persistent data": Way("", STANDARD, persistent=False),
        "12 bounces instead of 4": Way("", replace(STANDARD, max_bounces=12)),
        "2 bounces instead of 4": Way("", replace(STANDARD, max_bounces=2)),
        "light wanders in any skin": Way("", replace(STANDARD, scatter_from_px=0.0)),
        "light wanders from a path of half a pixel": Way(
            "", replace(STANDARD, scatter_from_px=0.5)
        ),
        "light wanders from a path of 2 pixels": Way("", replace(STANDARD, scatter_from_px=2.0)),
        "denoiser fast": Way("", replace(STANDARD, denoise=Denoise.FAST)),
        "denoiser high": Way("", replace(STANDARD, denoise=Denoise.HIGH)),
        "prefilter accurate": Way("", replace(STANDARD, prefilter=Prefilter.ACCURATE)),
        "no prefilter": Way("", replace(STANDARD, prefilter=Prefilter.NONE)),
        "no denoiser": Way("", replace(STANDARD, denoise=Denoise.NONE)),
        "importance map 1024": Way("", STANDARD, importance_map_px=1024),
        "importance map 256": Way("", STANDARD, importance_map_px=256),
        "adaptive sampling, threshold 0.1": Way(
            "", replace(STANDARD, samples=4 * STANDARD.samples), properties=ADAPTIVE
        ),
        "no light tree": Way("", STANDARD, properties=(("use_light_tree", False),)),
        "indirect light cut at 4 x white": Way("", STANDARD, clamp_white=(0.0, 4.0)),
        "indirect light cut at 1 x white": Way("", STANDARD, clamp_white=(0.0, 1.0)),
        "direct light cut at 16 x white, indirect at 4": Way("", STANDARD, clamp_white=(16.0, 4.0)),
        "no clamping": Way("", STANDARD, properties=(("sample_clamp_indirect", 0.0),)),
        "Sobol points instead of blue noise": Way("", STANDARD, properties=PLAIN_PATTERN),
        "outline as sampled": Way("", STANDARD, outline=False),
        "next image not staged ahead": Way("", STANDARD, ahead=False),
    }
    return [
        replace(way, name=name, group="ablation")
        for name, way in without.items()
        if not essential or name in ESSENTIAL
    ]


def _name(settings: RenderSettings) -> str:
    guides = "" if settings.denoise is Denoise.NONE else f"/{settings.prefilter.value}"
    return f"{settings.denoise.value}{guides} {settings.samples}"
