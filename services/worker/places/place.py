"""A place as plain data: surfaces, finishes, lamps, a sky, and where the eye stands.

Metres; +z is up; the eye looks along +x in the middle of its panorama.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Rgb = tuple[float, float, float]
Point = tuple[float, float, float]


def rgb_of(values: Iterable[float]) -> Rgb:
    """Return three numbers as a colour."""
    red, green, blue = (float(value) for value in values)
    return (red, green, blue)


def muted(rng: np.random.Generator, low: float, high: float) -> Rgb:
    """Return a colour as things have it: more grey than not."""
    colour = rng.uniform(low, high, 3)
    return rgb_of(0.45 * colour + 0.55 * colour.mean())


def vivid(rng: np.random.Generator, low: float, high: float) -> Rgb:
    """Return a colour as pictures, covers and toys have it: more colour than grey."""
    colour = rng.uniform(low, high, 3)
    colour[int(rng.integers(0, 3))] *= 0.3
    return rgb_of(0.75 * colour + 0.25 * colour.mean())


class Pattern(StrEnum):
    """How a finish varies over a surface; each is a shader of the Blender part."""

    PLAIN = "plain"
    MOTTLED = "mottled"
    PLANKS = "planks"
    TILES = "tiles"
    WINDOWS = "windows"
    VEINS = "veins"
    PATCHES = "patches"
    WAVES = "waves"
    PICTURE = "picture"
    LEAVES = "leaves"
    GLOW = "glow"


@dataclass(frozen=True)
class Finish:
    """What a surface is made of. Colours are linear Rec. 709 albedos; GLOW radiates `rgb`.

    `second_rgb` is the pattern's other colour, `scale_m` the size of its largest feature.
    """

    pattern: Pattern
    rgb: Rgb
    second_rgb: Rgb = (0.1, 0.1, 0.1)
    scale_m: float = 1.0
    roughness: float = 0.7
    metallic: float = 0.0


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh of one finish: vertices_m (V, 3), quads (Q, 4), uvs_m (Q, 4, 2) along the surface."""

    finish: Finish
    vertices_m: Array
    quads: npt.NDArray[np.int32]
    uvs_m: Array
    smooth: bool = False


@dataclass(frozen=True, eq=False)
class Copies:
    """Many copies of some surfaces: at_m (N, 3), turns_rad (N,) about the vertical, sizes (N,)."""

    surfaces: tuple[Surface, ...]
    at_m: Array
    turns_rad: Array
    sizes: Array


@dataclass(frozen=True)
class AreaLamp:
    """A rectangle that shines along `towards`: radiance (W/m2/sr, linear RGB) over its face.

    The lamp itself is invisible; what glows in the picture is a surface of its own.
    """

    at_m: Point
    towards: Point
    width_m: float
    height_m: float
    radiance: Rgb
    spread_deg: float = 180.0


@dataclass(frozen=True)
class PointLamp:
    """A ball that shines all around with `intensity` (W/sr, linear RGB)."""

    at_m: Point
    radius_m: float
    intensity: Rgb


@dataclass(frozen=True)
class Sky:
    """The air and what floats in it. `haze` is the aerosol density (1 is a city), clouds 0..1.

    `overcast` 0..1 mixes the clear sky with one grey lid; `visibility_m` is how far away a thing
    has lost two thirds of its contrast.
    """

    sun_elevation_deg: float
    sun_azimuth_deg: float
    haze: float = 1.0
    ozone: float = 1.0
    altitude_m: float = 100.0
    clouds: float = 0.0
    cloud_size: float = 1.0
    overcast: float = 0.0
    visibility_m: float = 8000.0


@dataclass(frozen=True, eq=False)
class Place:
    """Everything that is baked into one panorama. Without a sky there is nothing outside."""

    surfaces: tuple[Surface, ...]
    eye_m: Point
    copies: tuple[Copies, ...] = ()
    area_lamps: tuple[AreaLamp, ...] = ()
    point_lamps: tuple[PointLamp, ...] = ()
    sky: Sky | None = None
    outside_rgb: Rgb = (0.0, 0.0, 0.0)
    clamp: float = 64.0
