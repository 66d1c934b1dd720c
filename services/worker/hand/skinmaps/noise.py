"""Smooth noise in space: the same value at the same point of skin, whichever texel shows it."""

import numpy as np

from hi5_common.domain.seeding import factor_rng
from services.worker.hand.asset import F8

LATTICE = 32
OCTAVE_GAIN = 0.5


def value_noise(points_mm: F8, wavelength_mm: float, name: str) -> F8:
    """Noise (N,) in about -1..1, mean 0, that changes over `wavelength_mm`.

    points_mm (N, 3). Random values on a cubic lattice that repeats after 32 cells, with smooth
    steps between. `name` keys the lattice: two names are independent.
    """
    lattice = factor_rng(0, 0, f"skin_noise/{name}").uniform(-1.0, 1.0, LATTICE**3)
    scaled = points_mm / wavelength_mm
    cell = np.floor(scaled)
    step = scaled - cell
    step = step * step * (3.0 - 2.0 * step)
    low = cell.astype(np.int64) % LATTICE
    high = (low + 1) % LATTICE
    rows = (low[:, 0] * LATTICE**2, high[:, 0] * LATTICE**2)
    columns = (low[:, 1] * LATTICE, high[:, 1] * LATTICE)
    layers = (low[:, 2], high[:, 2])
    faces = []
    for row in rows:
        lines = []
        for column in columns:
            at = row + column
            first, last = lattice[at + layers[0]], lattice[at + layers[1]]
            lines.append(first + (last - first) * step[:, 2])
        faces.append(lines[0] + (lines[1] - lines[0]) * step[:, 1])
    noise: F8 = faces[0] + (faces[1] - faces[0]) * step[:, 0]
    return noise


def fractal_noise(points_mm: F8, wavelength_mm: float, octaves: int, name: str) -> F8:
    """Octaves of value noise (N,), each half as long and half as strong, scaled to about -1..1."""
    total = np.zeros(len(points_mm))
    gain, most = 1.0, 0.0
    for octave in range(octaves):
        total += gain * value_noise(points_mm, wavelength_mm / 2.0**octave, f"{name}/{octave}")
        most += gain
        gain *= OCTAVE_GAIN
    return total / most
