"""What a dataset costs to make, as quotas count it: images, pixels, and samples of those pixels."""

from dataclasses import dataclass

from hi5_common.domain.spec import DatasetSpec, Engine, Quality

SAMPLES_PER_PIXEL = {
    Engine.CYCLES: {
        Quality.DRAFT: 1,
        Quality.STANDARD: 3,
        Quality.HIGH: 16,
        Quality.REFERENCE: 512,
    },
    Engine.EEVEE: {Quality.DRAFT: 8, Quality.STANDARD: 32, Quality.HIGH: 128},
}
"""As services/worker/render/settings.py has them; a test compares the two."""
MOST_SAMPLES_PER_PIXEL = 512
"""What max_error and seconds_per_image may come to, and are counted as: it depends on the scene."""
MOST_COUNTED = 2**62
"""A column holds no more than 2**63 - 1; no quota is as large as this."""


@dataclass(frozen=True)
class Cost:
    """Numbers of all images of a dataset together, those of a dataset that it extends too."""

    images: int
    pixels: int
    samples: int


def cost_of(spec: DatasetSpec) -> Cost:
    """Return what a spec's images come to."""
    pixels = spec.count * spec.image.width * spec.image.height
    samples = pixels * samples_per_pixel(spec)
    return Cost(spec.count, min(pixels, MOST_COUNTED), min(samples, MOST_COUNTED))


def samples_per_pixel(spec: DatasetSpec) -> int:
    """Return how many samples a pixel gets, or the most it may get where that is not asked for."""
    if spec.render.quality is None:
        return MOST_SAMPLES_PER_PIXEL
    return SAMPLES_PER_PIXEL[spec.render.engine][spec.render.quality]
