"""How nuisance factors are spread: over all images, and over the values of each attribute."""

from collections.abc import Iterator

import numpy as np

from hi5_common.domain.strict import StrictModel
from hi5_common.domain.vocabulary import Attribute
from hi5_common.fairness.observed import F8, Measure, Observed

BARS = 24
PERCENTILES = (5.0, 25.0, 50.0, 75.0, 95.0)


class Spread(StrictModel):
    """The percentiles 5, 25, 50, 75, 95 of a measure over the images of one value."""

    value: str
    images: int
    percentiles: tuple[float, float, float, float, float]


class MeasureSpread(StrictModel):
    """One measure: a histogram of all images, and its spread by the values of attributes.

    edges has one number more than histogram.
    """

    measure: Measure
    images: int
    edges: tuple[float, ...]
    histogram: tuple[int, ...]
    overall: Spread
    by_attribute: dict[Attribute, tuple[Spread, ...]]


def spreads(observed: Observed, attributes: tuple[Attribute, ...]) -> tuple[MeasureSpread, ...]:
    """Return the measures that the labels know, each by the values of attributes."""
    return tuple(
        _spread(observed, measure, numbers, attributes)
        for measure in Measure
        for numbers in (observed.measure(measure),)
        if (~np.isnan(numbers)).any()
    )


def _spread(
    observed: Observed, measure: Measure, numbers: F8, attributes: tuple[Attribute, ...]
) -> MeasureSpread:
    known = ~np.isnan(numbers)
    histogram, edges = np.histogram(numbers[known], BARS)
    return MeasureSpread(
        measure=measure,
        images=int(known.sum()),
        edges=tuple(edges.tolist()),
        histogram=tuple(histogram.tolist()),
        overall=_of("all", numbers[known]),
        by_attribute={name: tuple(_by(observed, name, numbers)) for name in attributes},
    )


def _by(observed: Observed, name: Attribute, numbers: F8) -> Iterator[Spread]:
    codes = observed.codes(name)
    for number, value in enumerate(observed.values(name)):
        mine = numbers[(codes == number) & ~np.isnan(numbers)]
        if len(mine):
            yield _of(value, mine)


def _of(value: str, numbers: F8) -> Spread:
    five, low, middle, high, top = np.percentile(numbers, PERCENTILES).tolist()
    return Spread(value=value, images=len(numbers), percentiles=(five, low, middle, high, top))
