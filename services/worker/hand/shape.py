"""What one hand differs in from another of the same gender: six continuous factors."""

from dataclasses import dataclass, fields, replace

AGE_YEARS = (18.0, 90.0)
YOUNG_YEARS, OLD_YEARS = 25.0, 90.0
"""The ages of MakeHuman's targets `young` and `old`; a hand is full grown before the first."""
SCALE_SPREAD = 1.645 * 0.052
"""Half the width from 5th to 95th percentile of hand length: its standard deviation is 9.8 of 193.8
mm in men, 9.7 of 180.5 mm in women (US Army survey of 1988, Gordon et al., NATICK/TR-89/044)."""
FINGER_LENGTH_SPREAD = 0.055
"""The same of a finger's length in a hand of given length: about 0.01 of 0.43 is the standard
deviation of the ratio of middle finger to hand."""
FINGER_THICKNESS_SPREAD = 0.09
"""The same of a finger's breadth in a hand of given length (about 1.2 of 22 mm at the PIP)."""

_RANGES = {
    "age_years": AGE_YEARS,
    "weight": (0.0, 1.0),
    "muscle": (0.0, 1.0),
    "finger_length": (-1.0, 1.0),
    "finger_thickness": (-1.0, 1.0),
    "scale": (-1.0, 1.0),
}


@dataclass(frozen=True)
class HandShape:
    """One hand among the hands of a gender.

    age_years 18..90; weight 0 (thin) .. 1 (heavy) and muscle 0..1, both 0.5 on average;
    finger_length, finger_thickness, scale: -1 is about the 5th, 0 the 50th, +1 the 95th percentile.
    ValueError for a value outside, naming the factor.
    """

    age_years: float
    weight: float
    muscle: float
    finger_length: float
    finger_thickness: float
    scale: float

    def __post_init__(self) -> None:
        """Refuse what no adult hand is."""
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"{name} is {value}; it must be from {low:g} to {high:g}")

    @classmethod
    def average(cls) -> "HandShape":
        """The middle of every factor, at 35 years."""
        return cls(35.0, 0.5, 0.5, 0.0, 0.0, 0.0)

    @property
    def oldness(self) -> float:
        """How far from the target `young` (0) to `old` (1)."""
        return max(0.0, (self.age_years - YOUNG_YEARS) / (OLD_YEARS - YOUNG_YEARS))


def _extremes() -> tuple[tuple[str, HandShape], ...]:
    average = HandShape.average()
    alone = [
        (f"{field.name}_{end}", replace(average, **{field.name: _RANGES[field.name][at]}))
        for field in fields(HandShape)
        for at, end in enumerate(("low", "high"))
    ]
    slight, stout = (HandShape(*(r[at] for r in _RANGES.values())) for at in (0, 1))
    return (*alone, ("all_low", slight), ("all_high", stout))


SHAPE_EXTREMES: tuple[tuple[str, HandShape], ...] = _extremes()
"""Each factor at either end with the others average, then all at once at either end."""
