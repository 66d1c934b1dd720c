"""What quotas count."""

from hi5_common.domain.cost import MOST_COUNTED, MOST_SAMPLES_PER_PIXEL, SAMPLES_PER_PIXEL, cost_of
from hi5_common.domain.spec import Engine, parse_spec
from services.worker.render.calibration import SAMPLES
from services.worker.render.settings import EEVEE_SETTINGS, QUALITY_SETTINGS


def test_samples_are_those_that_workers_trace() -> None:
    for engine, settings in ((Engine.CYCLES, QUALITY_SETTINGS), (Engine.EEVEE, EEVEE_SETTINGS)):
        traced = {quality: each.samples for quality, each in settings.items()}
        assert SAMPLES_PER_PIXEL[engine] == traced
    assert max(SAMPLES) == MOST_SAMPLES_PER_PIXEL


def test_pixels_and_samples_are_of_all_images() -> None:
    image = {"width": 100, "height": 50}
    cost = cost_of(parse_spec({"count": 7, "image": image, "render": {"quality": "high"}}))
    assert (cost.images, cost.pixels, cost.samples) == (7, 35_000, 560_000)
    by_error = cost_of(parse_spec({"count": 1, "image": image, "render": {"max_error": 0.02}}))
    assert by_error.samples == 5_000 * 512


def test_the_largest_dataset_fits_a_column() -> None:
    image = {"width": 8192, "height": 8192}
    spec = parse_spec({"count": 1_000_000_000, "image": image, "render": {"quality": "reference"}})
    assert cost_of(spec).samples == MOST_COUNTED < 2**63
