"""The scenes that everything is measured on: fixed, whatever hi5's planner comes to do."""

from dataclasses import dataclass

from hi5_common.domain.plan import Cell, cell_of
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import ALWAYS_BALANCED

CELLS = (
    "male dark neutral_rigid street_morning right first_person",
    "female tan a_okay_upright forest left first_person",
    "male tan capisce night right third_person",
    "male light middle_tip meadow_noon left second_person",
    "female brown fist city right first_person",
    "male brown surfer snow_sun left third_person",
    "female tan a_okay street_morning left second_person",
    "male very_light claws studio_grey left third_person",
    "male light star_trek interior right first_person",
    "female intermediate fist_wave meadow_noon right third_person",
    "male brown three office_night right second_person",
    "female very_light two snow_sun right second_person",
    "female light one living_day right third_person",
    "male dark dinosaur forest right second_person",
    "female intermediate alligator_open interior left second_person",
    "male intermediate rocker sunset left first_person",
    "female very_light relaxed_wave office_night left first_person",
    "female dark finger_spread_rigid courtyard left third_person",
)
"""The attributes that are always balanced, in their order: the first twelve scenes are measured."""
SIDE_PX = 640
MEASURED = 12
SEED = 40


class BenchPlan:
    """The cells, as a plan gives them."""

    def cell(self, index: int) -> Cell:
        """Return the attribute values of a scene."""
        return cell_of(dict(zip(ALWAYS_BALANCED, CELLS[index].split(), strict=True)))

    def split_of(self, _index: int, /) -> None:
        """Return None: the scenes are not split."""


@dataclass(frozen=True)
class Bench:
    """A spec with the numbers of its images that are measured, and of those that confirm."""

    spec: DatasetSpec
    plan: BenchPlan
    measured: tuple[int, ...]
    confirmed: tuple[int, ...]


def bench_scenes(side_px: int = SIDE_PX) -> Bench:
    """Return the twelve scenes and the six others: all tones, 18 poses, 12 places, any distance."""
    spec = parse_spec(
        {"count": len(CELLS), "seed": SEED, "image": {"width": side_px, "height": side_px}}
    )
    every = tuple(range(len(CELLS)))
    return Bench(spec, BenchPlan(), every[:MEASURED], every[MEASURED:])
