"""The planes of a skin map: what each says of a point of skin, and how its numbers are kept."""

from enum import StrEnum


class Plane(StrEnum):
    """One quantity over the hand. Individuals differ in how much of each plane they show.

    Shares lie in 0..1, unevenness in -1..1 about 0, heights are millimetres over the mesh.
    Planes that end in _A and _B are drawn independently: two fields, sets of lines, trees.
    """

    GLABROUS = "glabrous"
    BLOOD = "blood"
    MELANIN = "melanin"
    BLOTCH_A = "blotch_a"
    BLOTCH_B = "blotch_b"
    MOTTLE_A = "mottle_a"
    MOTTLE_B = "mottle_b"
    VEINS_A = "veins_a"
    VEINS_B = "veins_b"
    FRECKLES_A = "freckles_a"
    FRECKLES_B = "freckles_b"
    AGE_SPOTS_A = "age_spots_a"
    AGE_SPOTS_B = "age_spots_b"
    LINES_A = "lines_a"
    LINES_B = "lines_b"
    LINES_FINE = "lines_fine"
    FLEXION = "flexion"
    NAIL = "nail"
    NAIL_ALONG = "nail_along"
    LUNULA = "lunula"
    STILL = "still"
    WRINKLES = "wrinkles"
    PATTERN = "pattern"
    TENDONS = "tendons"
    CREPE = "crepe"


UNEVEN = (
    Plane.BLOOD,
    Plane.MELANIN,
    Plane.BLOTCH_A,
    Plane.BLOTCH_B,
    Plane.MOTTLE_A,
    Plane.MOTTLE_B,
    Plane.NAIL_ALONG,
)
"""Kept as bytes about 128."""
HEIGHTS = (Plane.STILL, Plane.WRINKLES, Plane.PATTERN, Plane.TENDONS, Plane.CREPE)
"""Kept as 16-bit integers; all others are bytes."""
MARKS = tuple(plane for plane in Plane if plane not in HEIGHTS)
PLANES = (*MARKS, *HEIGHTS)
"""The order of the columns of a map's statistics."""

SHARE_STEP, UNEVEN_STEP, UNEVEN_ZERO = 1.0 / 255.0, 1.0 / 127.0, 128.0
HEIGHT_STEP_MM = 1e-4


def scale_of(plane: Plane) -> tuple[float, float]:
    """Return (step, zero) of a plane: its value is step x (stored number - zero)."""
    if plane in HEIGHTS:
        return HEIGHT_STEP_MM, 0.0
    return (UNEVEN_STEP, UNEVEN_ZERO) if plane in UNEVEN else (SHARE_STEP, 0.0)
