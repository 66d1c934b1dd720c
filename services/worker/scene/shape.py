"""Which hand of its gender an image shows: six factors, each drawn inside the band asked for."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from hi5_common.domain.bands import parse_band
from hi5_common.domain.distributions import Distribution, Normal, Uniform
from hi5_common.domain.plan import Cell
from hi5_common.domain.vocabulary import Attribute
from services.worker.hand.shape import HandShape

_EVENLY = Distribution(uniform=Uniform())
_BUILD = Distribution(normal=Normal(mean=0.5, sd=0.2))
"""Weight and muscle: most people are near the average, few at either end."""
_PERCENTILE = Distribution(normal=Normal(mean=0.0, sd=1.0 / 1.645))
"""Length, thickness and scale: -1 and 1 are the 5th and the 95th percentile."""

USUAL: Mapping[Attribute, Distribution] = MappingProxyType(
    {
        Attribute.AGE: _EVENLY,
        Attribute.WEIGHT: _BUILD,
        Attribute.MUSCLE: _BUILD,
        Attribute.FINGER_LENGTH: _PERCENTILE,
        Attribute.FINGER_THICKNESS: _PERCENTILE,
        Attribute.HAND_SCALE: _PERCENTILE,
    }
)
"""What is drawn from where a spec says nothing: age evenly, the rest as people are spread."""


def draw_shape(
    cell: Cell, rng: np.random.Generator, asked: Mapping[Attribute, Distribution]
) -> HandShape:
    """Draw the shape of a cell's hand from the distributions asked for, cut to the cell's bands.

    Each factor takes one number from `rng` in a fixed order, whatever the bands and distributions
    are: one that is fixed moves no other factor.
    """
    shares = rng.uniform(size=len(USUAL)).tolist()
    age, weight, muscle, length, thickness, scale = (
        asked.get(name, usual).within(parse_band(getattr(cell, name.value)), share)
        for (name, usual), share in zip(USUAL.items(), shares, strict=True)
    )
    return HandShape(
        age_years=age,
        weight=weight,
        muscle=muscle,
        finger_length=length,
        finger_thickness=thickness,
        scale=scale,
    )
