"""Which hand of its gender an image shows: six factors, each drawn inside the band asked for."""

from statistics import NormalDist

import numpy as np

from hi5_common.domain.bands import Band, parse_band
from hi5_common.domain.plan import Cell
from services.worker.hand.shape import HandShape

BUILD = NormalDist(0.5, 0.2)
"""Weight and muscle: most people are near the average, few at either end."""
PERCENTILE = NormalDist(0.0, 1.0 / 1.645)
"""Length, thickness and scale: -1 and 1 are the 5th and the 95th percentile."""


def draw_shape(cell: Cell, rng: np.random.Generator) -> HandShape:
    """Draw the shape of a cell's hand: age evenly, the rest as people are spread, in the bands.

    Each factor takes one number from `rng` in a fixed order, whatever the bands are: a band that
    is fixed moves no other factor.
    """
    shares = rng.uniform(size=6).tolist()
    age, weight, muscle = map(parse_band, (cell.age, cell.weight, cell.muscle))
    fingers_and_scale = (cell.finger_length, cell.finger_thickness, cell.hand_scale)
    length, thickness, scale = map(parse_band, fingers_and_scale)
    return HandShape(
        age_years=age.at(shares[0]),
        weight=_within(BUILD, weight, shares[1]),
        muscle=_within(BUILD, muscle, shares[2]),
        finger_length=_within(PERCENTILE, length, shares[3]),
        finger_thickness=_within(PERCENTILE, thickness, shares[4]),
        scale=_within(PERCENTILE, scale, shares[5]),
    )


def _within(spread: NormalDist, band: Band, share: float) -> float:
    """Return the quantile `share` of a distribution cut to a band."""
    below, above = spread.cdf(band.low), spread.cdf(band.high)
    drawn = spread.inv_cdf(below + share * (above - below))
    return min(max(drawn, band.low), band.high)
