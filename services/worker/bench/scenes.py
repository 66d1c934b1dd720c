"""The scenes that everything is measured on: drawn once by hi5's planner, from a fixed seed."""

from dataclasses import dataclass

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec

ENVIRONMENTS = (
    *("forest", "city", "sunset", "night", "courtyard", "interior"),
    *("meadow_noon", "snow_sun", "street_morning", "living_day", "office_night", "studio_grey"),
)
SIDE_PX = 640
MEASURED, CONFIRMED = 12, 6
SEED = 40


@dataclass(frozen=True)
class Bench:
    """A spec with the numbers of its images that are measured, and of those that confirm."""

    spec: DatasetSpec
    plan: Plan
    measured: tuple[int, ...]
    confirmed: tuple[int, ...]


def bench_scenes(side_px: int = SIDE_PX) -> Bench:
    """Return the twelve scenes and the six others: all tones, 18 poses, 12 places, any distance."""
    spec = parse_spec(
        {
            "count": MEASURED + CONFIRMED,
            "seed": SEED,
            "image": {"width": side_px, "height": side_px},
            "attributes": {"environment": list(ENVIRONMENTS)},
        }
    )
    every = tuple(range(MEASURED + CONFIRMED))
    return Bench(spec, Plan.of(spec), every[:MEASURED], every[MEASURED:])
