"""How a continuous factor is spread inside its bands: what a spec may choose.

A distribution is cut to the band that an image has, and its quantile is taken at one even number:
another distribution moves no other factor of any image.
"""

import math
from statistics import NormalDist
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import pydantic
from pydantic import BeforeValidator, Field, SerializerFunctionWrapHandler
from pydantic_core import PydanticCustomError

from hi5_common.domain.bands import Band, parse_band
from hi5_common.domain.errors import Problem
from hi5_common.domain.strict import StrictModel
from hi5_common.domain.vocabulary import SHAPE_RANGES

if TYPE_CHECKING:
    from hi5_common.domain.spec import DatasetSpec

LEAST_MASS = 1e-6
"""The share of a distribution that a band must hold: far less is a slip, and drawn badly."""
_OVER_NONE = 2.0**-53

Number = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False, strict=True)]


class Uniform(StrictModel):
    """Every number of the band alike."""


class Normal(StrictModel):
    """The normal distribution, in the factor's own unit."""

    mean: Number
    sd: float = Field(ge=1e-6, le=1e6, allow_inf_nan=False, strict=True)

    def cdf(self, number: float) -> float:
        """Return the share that lies below a number."""
        return NormalDist(self.mean, self.sd).cdf(number)

    def quantile(self, share: float) -> float:
        """Return the number below which a share (0 < share < 1) lies."""
        return NormalDist(self.mean, self.sd).inv_cdf(share)


class Triangular(StrictModel):
    """Nothing up to low, a straight rise up to mode, a straight fall to nothing at high."""

    low: Number
    mode: Number
    high: Number

    @pydantic.model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.low <= self.mode <= self.high or self.low == self.high:
            words = "Give low <= mode <= high, and low below high"
            raise PydanticCustomError("not_in_order", words)
        return self

    def cdf(self, number: float) -> float:
        """Return the share that lies below a number."""
        whole = self.high - self.low
        if not self.low < number < self.high:
            return float(number >= self.high)
        if number < self.mode:
            return (number - self.low) ** 2 / (whole * (self.mode - self.low))
        return 1.0 - (self.high - number) ** 2 / (whole * (self.high - self.mode))

    def quantile(self, share: float) -> float:
        """Return the number below which a share (0 < share < 1) lies."""
        whole, rise = self.high - self.low, self.mode - self.low
        if share * whole < rise:
            return self.low + math.sqrt(share * whole * rise)
        return self.high - math.sqrt((1.0 - share) * whole * (self.high - self.mode))


class Distribution(StrictModel):
    """Just one of them."""

    uniform: Uniform | None = None
    normal: Normal | None = None
    triangular: Triangular | None = None

    @pydantic.model_validator(mode="after")
    def _just_one(self) -> Self:
        if len([name for name in type(self).model_fields if getattr(self, name)]) != 1:
            names = ", ".join(type(self).model_fields)
            raise PydanticCustomError("not_one", f"Name just one of {names}")
        return self

    @pydantic.model_serializer(mode="wrap")
    def _named_alone(self, written: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the others, so that there may be more of them some day."""
        return {name: found for name, found in written(self).items() if found is not None}

    @property
    def _curve(self) -> Normal | Triangular | None:
        return self.normal or self.triangular

    def mass(self, band: Band) -> float:
        """Return the share of the distribution that lies in a band; of a uniform one, all."""
        curve = self._curve
        return 1.0 if curve is None else curve.cdf(band.high) - curve.cdf(band.low)

    def within(self, band: Band, share: float) -> float:
        """Return the quantile `share` (0 <= share < 1) of the distribution cut to a band."""
        curve = self._curve
        if curve is None or band.low == band.high:
            return band.at(share)
        below, above = curve.cdf(band.low), curve.cdf(band.high)
        cut = min(max(below + share * (above - below), _OVER_NONE), 1.0 - _OVER_NONE)
        return min(max(curve.quantile(cut), band.low), band.high)


def _spelled_out(asked: object) -> object:
    return {"uniform": {}} if asked == "uniform" else asked


AskedDistribution = Annotated[
    Distribution,
    BeforeValidator(_spelled_out, json_schema_input_type=Distribution | Literal["uniform"]),
]


def problems(spec: "DatasetSpec") -> list[Problem]:
    """List what is wrong with the distributions of a spec whose attributes are right."""
    found = []
    for name, asked in spec.distributions.items():
        field = f"distributions.{name.value}"
        if name not in SHAPE_RANGES:
            known = ", ".join(factor.value for factor in SHAPE_RANGES)
            found.append(Problem(field, _worded(asked), f"It has no numbers; these have: {known}."))
            continue
        bands = [parse_band(value) for value in spec.values_of(name)]
        wide = [band for band in bands if band.low < band.high]
        if not wide:
            remedy = f"{name.value} has fixed values: name bands low..high, or leave this out."
            found.append(Problem(field, _worded(asked), remedy))
        for band in (band for band in wide if asked.mass(band) < LEAST_MASS):
            remedy = f"Next to none of it ({asked.mass(band):.2g}) lies in the band {band}."
            found.append(Problem(field, _worded(asked), f"{remedy} Change either."))
    return found


def _worded(asked: Distribution) -> object:
    return asked.model_dump(mode="json")
