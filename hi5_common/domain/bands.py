"""Bands of a continuous factor: "18..30", or "35" for one fixed value."""

import math
import re
from dataclasses import dataclass

NUMBER = r"[+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?"
_BAND = re.compile(rf"\s*({NUMBER})\s*(?:\.\.\s*({NUMBER})\s*)?", re.ASCII)


@dataclass(frozen=True, order=True)
class Band:
    """The numbers from low to high, both included; a fixed value where they are equal."""

    low: float
    high: float

    def at(self, share: float) -> float:
        """Return the number `share` (0..1) of the way from low to high."""
        return self.low + share * (self.high - self.low)

    def __str__(self) -> str:
        low, high = number_text(self.low), number_text(self.high)
        return low if low == high else f"{low}..{high}"


@dataclass(frozen=True)
class ShapeRange:
    """The human range of a shape factor, its unit, and what an average hand has."""

    low: float
    high: float
    average: float
    unit: str

    @property
    def band(self) -> Band:
        return Band(self.low, self.high)


def parse_band(value: str) -> Band:
    """Read a band or a number; ValueError if it is neither or runs backwards."""
    match = _BAND.fullmatch(value)
    if match is None:
        raise ValueError(f"{value!r} is neither a number nor a band such as 18..30")
    low = float(match[1])
    high = low if match[2] is None else float(match[2])
    if not (math.isfinite(low) and math.isfinite(high)):
        raise ValueError(f"{value!r} has ends that are not finite numbers")
    if high < low:
        raise ValueError(f"{value!r} runs backwards")
    return Band(low, high)


def number_text(number: float) -> str:
    """Return the shortest text of a finite number: 41, -17.5; equal numbers give equal texts."""
    whole = round(number)
    return str(whole) if whole == number else repr(float(number))
