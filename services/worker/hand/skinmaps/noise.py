"""Smooth noise in space: the same value at the same point of skin, whichever texel shows it."""

import numpy as np
import numpy.typing as npt

from hi5_common.domain.seeding import factor_rng

Array = npt.NDArray[np.floating]

LATTICE = 32
OCTAVE_GAIN = 0.5


def value_noise(points_mm: Array, wavelength_mm: float, name: str) -> Array:
    """Noise (N,) in about -1..1, mean 0, that changes over `wavelength_mm`.

    points_mm (N, 3). Random values on a cubic lattice that repeats after 32 cells, with smooth
    steps between. `name` keys the lattice: two names are independent.
    """
    rng = factor_rng(0, 0, f"skin_noise/{name}")
    lattice = rng.uniform(-1.0, 1.0, LATTICE**3).astype(np.float32)
    scaled = np.ascontiguousarray(points_mm.T, dtype=np.float32) / np.float32(wavelength_mm)
    cell = np.floor(scaled)
    step = scaled - cell
    step *= step * (3.0 - 2.0 * step)
    low = cell.astype(np.int32) & (LATTICE - 1)
    high = (low + 1) & (LATTICE - 1)
    rows = (low[0] * LATTICE**2, high[0] * LATTICE**2)
    columns = (low[1] * LATTICE, high[1] * LATTICE)
    faces = []
    for row in rows:
        lines = []
        for column in columns:
            at = row + column
            first, last = lattice[at + low[2]], lattice[at + high[2]]
            lines.append(first + (last - first) * step[2])
        faces.append(lines[0] + (lines[1] - lines[0]) * step[1])
    noise: Array = faces[0] + (faces[1] - faces[0]) * step[0]
    return noise


def octaves_of(wavelength_mm: float, octaves: int) -> list[tuple[int, float, float]]:
    """Number, wavelength and share of the whole of each octave: half as long, half as strong."""
    gains = [OCTAVE_GAIN**octave for octave in range(octaves)]
    return [(n, wavelength_mm / 2.0**n, gain / sum(gains)) for n, gain in enumerate(gains)]
