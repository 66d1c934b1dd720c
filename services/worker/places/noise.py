"""Fractal noise of chosen seeds, at any points of a plane or around a ring."""

import numpy as np

from services.worker.places.place import Array

_SIDE = 128
_TURN = 1.0347
"""Radians that each octave is turned by, so that their lattices never line up."""


class Fractal:
    """Smooth value noise summed over octaves; mean about 0, most values within -1..1."""

    def __init__(self, rng: np.random.Generator, octaves: int, gain: float = 0.5) -> None:
        self._lattices = rng.uniform(-1.0, 1.0, (octaves, _SIDE, _SIDE)).astype(np.float32)
        self._shifts = rng.uniform(0.0, _SIDE, (octaves, 2))
        self._gain = gain

    def at(self, x: Array, y: Array) -> Array:
        """Return the noise at points of any shape; the largest features are about 1 wide."""
        total = np.zeros(np.broadcast(x, y).shape)
        weight, norm = 1.0, 0.0
        for octave, (lattice, shift) in enumerate(zip(self._lattices, self._shifts, strict=True)):
            angle, scale = _TURN * octave, 2.0**octave
            cosine, sine = np.cos(angle) * scale, np.sin(angle) * scale
            u, v = x * cosine - y * sine + shift[0], x * sine + y * cosine + shift[1]
            total += weight * _smooth(lattice, u, v)
            norm += weight**2
            weight *= self._gain
        scaled: Array = total * (1.6 / np.sqrt(norm))
        return scaled


def _smooth(
    lattice: np.ndarray[tuple[int, int], np.dtype[np.float32]], u: Array, v: Array
) -> Array:
    left, top = np.floor(u), np.floor(v)
    s, t = u - left, v - top
    s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
    x0, y0 = left.astype(np.int32) % _SIDE, top.astype(np.int32) % _SIDE
    x1, y1 = (x0 + 1) % _SIDE, (y0 + 1) % _SIDE
    upper = lattice[y0, x0] * (1 - s) + lattice[y0, x1] * s
    lower = lattice[y1, x0] * (1 - s) + lattice[y1, x1] * s
    mixed: Array = upper * (1 - t) + lower * t
    return mixed
