"""Places under the sky: meadows, shores, deserts, snow, woods, streets, squares, roofs."""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from services.worker.places.nature import (
    boulders,
    bushes,
    grass,
    lawn,
    litter,
    pebbles,
    reeds,
    trees,
)
from services.worker.places.noise import Fractal
from services.worker.places.place import Copies, Finish, Pattern, Place, Sky, Surface
from services.worker.places.shapes import box, land
from services.worker.places.town import (
    buildings_around,
    fence,
    parked_cars,
    people_sized_things,
    street_furniture,
)

EYE_M = 1.55
_GREEN = Finish(Pattern.PATCHES, (0.045, 0.085, 0.018), (0.11, 0.125, 0.035), 1.6, 1.0)
_DRY = Finish(Pattern.PATCHES, (0.16, 0.13, 0.055), (0.26, 0.2, 0.1), 1.9, 1.0)
_SAND = Finish(Pattern.PATCHES, (0.40, 0.29, 0.18), (0.52, 0.40, 0.26), 1.1, 1.0)
_RED_SAND = Finish(Pattern.PATCHES, (0.34, 0.15, 0.07), (0.45, 0.24, 0.12), 1.4, 1.0)
_SNOW = Finish(Pattern.PATCHES, (0.74, 0.77, 0.82), (0.84, 0.85, 0.87), 2.2, 0.9)
_ROCK = Finish(Pattern.PATCHES, (0.10, 0.095, 0.088), (0.25, 0.235, 0.21), 1.5, 1.0)
_SOIL = Finish(Pattern.PATCHES, (0.055, 0.038, 0.022), (0.12, 0.085, 0.05), 0.9, 1.0)
_FOREST_FLOOR = Finish(Pattern.PATCHES, (0.035, 0.045, 0.014), (0.11, 0.075, 0.035), 0.8, 1.0)
_ASPHALT = Finish(Pattern.PATCHES, (0.045, 0.045, 0.048), (0.085, 0.084, 0.083), 0.7, 0.85)
_PAVING = Finish(Pattern.TILES, (0.27, 0.25, 0.225), (0.10, 0.095, 0.09), 0.5, 0.8)
_COBBLES = Finish(Pattern.TILES, (0.16, 0.155, 0.15), (0.05, 0.048, 0.045), 0.16, 0.75)
_CONCRETE = Finish(Pattern.MOTTLED, (0.26, 0.255, 0.245), (0.36, 0.35, 0.335), 1.4, 0.85)
_GRAVEL = Finish(Pattern.PATCHES, (0.16, 0.15, 0.135), (0.34, 0.32, 0.30), 0.16, 1.0)
_WATER = Finish(Pattern.WAVES, (0.012, 0.03, 0.035), (0.0, 0.0, 0.0), 1.3, 0.12)
_PAINT = Finish(Pattern.MOTTLED, (0.50, 0.50, 0.48), (0.62, 0.62, 0.60), 0.3, 0.8)
_PLANKS = Finish(Pattern.PLANKS, (0.22, 0.155, 0.10), (0.29, 0.22, 0.15), 0.15, 0.8)


def ground(
    finish: Finish,
    rng: np.random.Generator,
    *,
    rough_m: float = 0.05,
    hills_m: float = 0.0,
    hills_from_m: float = 300.0,
    peaks: float = 1.0,
    shore_deg: float | None = None,
) -> Surface:
    """Return land around the eye: level where it stands, hills far away, under water at a shore.

    shore_deg: direction in which the land dips below water level (-0.6 m), or None.
    """
    radii = np.concatenate([[1e-3], np.geomspace(0.8, 14_000.0, 120)])
    sides = 640
    angles = np.arange(sides) * (2.0 * math.pi / sides)
    x, y = radii[:, None] * np.cos(angles), radii[:, None] * np.sin(angles)
    near, far = Fractal(rng, 5, 0.5), Fractal(rng, 7, 0.42)
    heights = near.at(x / 9.0, y / 9.0) * rough_m * np.minimum(radii / 4.0, 3.0)[:, None]
    swell = np.clip((radii - hills_from_m) / (3.0 * hills_from_m), 0.0, 1.0)[:, None] ** 1.2
    width = hills_from_m * 3.2
    ridge = far.at(x / width, y / width)
    ridge = (1.0 - np.abs(ridge)) ** 2 if peaks > 1.0 else 0.5 + 0.5 * ridge
    heights += hills_m * swell * ridge * peaks
    if shore_deg is not None:
        across = x * math.cos(math.radians(shore_deg)) + y * math.sin(math.radians(shore_deg))
        bend = near.at(x / 60.0, y / 60.0) * np.minimum(radii / 30.0, 1.0)[:, None] * 5.0
        wet = np.clip((across - 3.5 + bend) / 9.0, 0.0, 1.0)
        heights = heights * (1.0 - wet) - 3.0 * wet
    return land(finish, radii, heights)


def _water() -> Surface:
    radii = np.concatenate([[1e-3], np.geomspace(1.0, 14_000.0, 24)])
    return land(_WATER, radii, np.full((len(radii), 64), -0.55))


def _hilly(finish: Finish, rng: np.random.Generator, amount: float) -> Surface:
    return ground(finish, rng, rough_m=0.06, hills_m=110.0 * amount, hills_from_m=220.0)


def meadow(rng: np.random.Generator, variant: int) -> Place:
    """Return grass to the knee, single trees, woods on the hills."""
    soil = (_GREEN, _DRY, _GREEN, _GREEN)[variant % 4]
    dry = soil is _DRY
    copies = [
        *grass(rng, 1500, 1.1, 16.0, dry=dry),
        *lawn(rng, dry=dry),
        *trees(rng, 22, 28.0, 120.0, kind=variant),
        *trees(rng, 260, 130.0, 700.0, kind=variant + 1),
        *bushes(rng, 26, 12.0, 60.0),
    ]
    return _place([_hilly(soil, rng, 0.6 + 0.3 * (variant % 3))], copies)


def forest_edge(rng: np.random.Generator, variant: int) -> Place:
    """Return a clearing in a wood: trunks all around, floor of leaves, gaps to the sky."""
    copies = [
        *trees(rng, 84, 5.5, 34.0, kind=variant),
        *trees(rng, 170, 32.0, 90.0, kind=variant + 1),
        *bushes(rng, 80, 4.0, 26.0),
        *grass(rng, 700, 1.3, 12.0, dry=False),
        litter(rng, 9.0, green=variant % 2 == 1),
    ]
    return _place([ground(_FOREST_FLOOR, rng, rough_m=0.08)], copies)


def park(rng: np.random.Generator, variant: int) -> Place:
    """Return mown lawn, a path, benches, trees, and houses behind them."""
    turf = ground(_GREEN, rng, rough_m=0.02)
    path = _strip(_GRAVEL if variant % 2 else _PAVING, -1.2, 1.3, 0.02)
    copies = [*trees(rng, 34, 9.0, 60.0, kind=variant), *bushes(rng, 30, 7.0, 40.0)]
    copies += [_beyond(patch, 1.4) for patch in lawn(rng)]
    copies += [litter(rng, 9.0, green=variant != 2), pebbles(rng, 5.0)]
    things = [*street_furniture(rng, 7.0), *buildings_around(rng, 75.0, 150.0, (12.0, 24.0))]
    return _place([turf, path, *things], [*copies, *trees(rng, 80, 55.0, 80.0, kind=variant + 2)])


def garden(rng: np.random.Generator, variant: int) -> Place:
    """Return a back garden: lawn, terrace, fence, hedges, the house behind."""
    turf = ground(_GREEN, rng, rough_m=0.015)
    terrace = _strip(_PLANKS if variant % 2 else _PAVING, -3.2, 1.2, 0.04, length_m=9.0)
    house = buildings_around(rng, 6.5, 8.0, (5.0, 6.0), count=1, towards_deg=-90.0)
    copies = [
        *bushes(rng, 46, 5.0, 9.5),
        *trees(rng, 14, 9.0, 30.0, kind=variant),
        *grass(rng, 260, 2.5, 9.0, dry=False),
        *(_beyond(patch, 1.3, -3.3) for patch in lawn(rng)),
        litter(rng, 6.0, green=True),
    ]
    return _place([turf, terrace, *house, *fence(rng, 10.0), *people_sized_things(rng)], copies)


def desert(rng: np.random.Generator, variant: int) -> Place:
    """Return sand or red earth with dunes, boulders and dry shrubs."""
    sand = (_SAND, _RED_SAND, _DRY)[variant % 3]
    base = ground(
        sand,
        rng,
        rough_m=0.16,
        hills_m=(26.0, 150.0, 260.0)[variant % 3],
        hills_from_m=(18.0, 420.0, 700.0)[variant % 3],
        peaks=(1.0, 1.5, 1.6)[variant % 3],
    )
    copies = [
        *boulders(rng, 150, 2.2, 60.0),
        *grass(rng, 700 if variant % 3 == 2 else 160, 1.6, 34.0, dry=True),
        pebbles(rng, 7.0, (0.34, 0.25, 0.16)),
    ]
    return _place([base], copies)


def beach(rng: np.random.Generator, variant: int) -> Place:
    """Return sand that runs into the sea, dunes with grass behind."""
    base = ground(_SAND, rng, rough_m=0.07, hills_m=25.0, hills_from_m=60.0, shore_deg=20.0)
    dunes = [
        *grass(rng, 420, 5.0, 45.0, dry=True),
        *boulders(rng, 18 * (variant % 2 + 1), 3.0, 30.0),
        pebbles(rng, 6.0, (0.5, 0.46, 0.4)),
    ]
    return _place([base, _water()], [_behind(c, 20.0) for c in dunes])


def lake(rng: np.random.Generator, variant: int) -> Place:
    """Return a lake with reeds, woods and mountains around it, seen from its bank."""
    soil = (_GREEN, _GRAVEL, _ROCK)[variant % 3]
    base = ground(
        soil, rng, rough_m=0.06, hills_m=330.0, hills_from_m=650.0, peaks=1.5, shore_deg=10.0
    )
    green = [
        *reeds(rng, 130, 3.5, 18.0),
        *trees(rng, 60, 8.0, 70.0, kind=variant),
        *boulders(rng, 26, 2.5, 20.0),
        *bushes(rng, 30, 5.0, 40.0),
        pebbles(rng, 6.0),
        *(lawn(rng) if soil is _GREEN else ()),
    ]
    return _place([base, _water()], [_behind(c, 10.0) for c in green])


def snowfield(rng: np.random.Generator, variant: int) -> Place:
    """Return snow, dark firs, white mountains."""
    base = ground(_SNOW, rng, rough_m=0.1, hills_m=430.0, hills_from_m=900.0, peaks=1.5)
    copies = [
        *trees(rng, 70, 10.0, 90.0, kind=3),
        *trees(rng, 240, 90.0, 420.0, kind=3),
        *boulders(rng, 14, 4.0, 40.0),
    ]
    return _place([base], copies if variant != 2 else copies[-1:])


def mountains(rng: np.random.Generator, variant: int) -> Place:
    """Return bare rock and boulders before high ridges."""
    soil = (_ROCK, _GRAVEL, _GREEN)[variant % 3]
    base = ground(soil, rng, rough_m=0.14, hills_m=700.0, hills_from_m=1100.0, peaks=1.6)
    copies = [*boulders(rng, 320, 1.6, 50.0), *grass(rng, 240, 1.5, 18.0, dry=variant == 1)]
    copies += [pebbles(rng, 6.0), *(lawn(rng) if soil is _GREEN else ())]
    return _place([base], [*copies, *trees(rng, 40, 40.0, 200.0, kind=3)])


def street(rng: np.random.Generator, variant: int) -> Place:
    """Return a street between houses: lanes, kerbs, lamps, trees, parked cars."""
    half = 4.2
    road = _strip(_ASPHALT, -half, half, 0.0, length_m=600.0)
    kerbs = [_strip(_PAVING, side * half, side * (half + 3.4), 0.14, 600.0) for side in (-1.0, 1.0)]
    dashes = [_mark(x, -0.06, 3.0, 0.12) for x in np.arange(-90.0, 90.0, 7.0)]
    edges = [_mark(-300.0, side * (half - 0.3), 600.0, 0.1) for side in (-1.0, 1.0)]
    height = ((9.0, 16.0), (14.0, 30.0), (5.0, 8.0), (20.0, 60.0))[variant % 4]
    houses = buildings_around(rng, half + 3.6, 0.0, height, rows=True)
    copies = trees(rng, 16, 6.0, 70.0, kind=variant)
    kept = [_beside(c, half + 1.2) for c in copies]
    kept.append(litter(rng, 12.0, green=variant != 2))
    things = [*street_furniture(rng, half + 0.6, rows=True), *parked_cars(rng, half - 1.1)]
    base = ground(_ASPHALT, rng, rough_m=0.0)
    eye = (0.0, -0.9 if variant % 2 else 1.2, EYE_M + 0.14)
    return _place([_lowered(base), road, *kerbs, *dashes, *edges, *houses, *things], kept, eye)


def square(rng: np.random.Generator, variant: int) -> Place:
    """Return a paved square with houses all around, lamps, benches and a few trees."""
    floor = _strip((_COBBLES, _PAVING, _CONCRETE)[variant % 3], -60.0, 60.0, 0.0, 120.0)
    height = ((10.0, 18.0), (14.0, 22.0), (25.0, 80.0))[variant % 3]
    houses = buildings_around(rng, 34.0, 46.0, height)
    copies = [*trees(rng, 12, 12.0, 26.0, kind=variant), litter(rng, 9.0)]
    base = _lowered(ground(_ASPHALT, rng, rough_m=0.0))
    things = [*street_furniture(rng, 9.0), *people_sized_things(rng)]
    return _place([base, floor, *houses, *things], copies)


def car_park(rng: np.random.Generator, variant: int) -> Place:
    """Return marked bays, cars, flat buildings and hills far away."""
    floor = _lowered(ground(_ASPHALT, rng, rough_m=0.0, hills_m=140.0, hills_from_m=400.0), 0.0)
    bays = [_mark(x, y, 0.11, 4.8) for x in np.arange(-30.0, 30.0, 2.6) for y in (-9.0, 5.0)]
    cars = [*parked_cars(rng, 7.0, turned=True), *parked_cars(rng, -7.0, turned=True)]
    halls = buildings_around(rng, 45.0, 90.0, (6.0, 12.0) if variant % 2 else (8.0, 40.0))
    copies = [*trees(rng, 26, 22.0, 60.0, kind=variant), litter(rng, 9.0), pebbles(rng, 5.0)]
    return _place([floor, *bays, *cars, *halls, *street_furniture(rng, 12.0)], copies)


def roof(rng: np.random.Generator, variant: int) -> Place:
    """Return a roof terrace over a town, its parapet, planters and the skyline."""
    deck = _strip(_PLANKS if variant % 2 else _CONCRETE, -7.0, 7.0, 0.0, 16.0)
    walls = fence(rng, 7.0, solid=True)
    town = buildings_around(rng, 30.0, 500.0, (10.0, 70.0), count=210, down_m=34.0)
    base = _lowered(ground(_ASPHALT, rng, rough_m=0.0, hills_m=200.0, hills_from_m=900.0), 34.0)
    plants = [*bushes(rng, 12, 4.2, 6.4), litter(rng, 5.0, green=True)]
    return _place([deck, *walls, *town, base, *people_sized_things(rng)], plants)


OUTDOORS: Mapping[str, Callable[[np.random.Generator, int], Place]] = MappingProxyType(
    {
        "meadow": meadow,
        "forest_edge": forest_edge,
        "park": park,
        "garden": garden,
        "desert": desert,
        "beach": beach,
        "lake": lake,
        "snowfield": snowfield,
        "mountains": mountains,
        "street": street,
        "square": square,
        "car_park": car_park,
        "roof": roof,
    }
)


def _place(
    surfaces: list[Surface], copies: list[Copies], eye: tuple[float, float, float] = (0, 0, EYE_M)
) -> Place:
    sky = Sky(30.0, 0.0)
    return Place(tuple(surfaces), eye, tuple(copies), sky=sky)


def _strip(
    finish: Finish, low_y: float, high_y: float, z: float, length_m: float = 300.0
) -> Surface:
    low, high = min(low_y, high_y), max(low_y, high_y)
    return box(finish, (-length_m / 2, low, z - 0.3), (length_m / 2, high, z + 0.001))


def _mark(x: float, y: float, length_m: float, width_m: float) -> Surface:
    return box(_PAINT, (x, y, 0.0), (x + length_m, y + width_m, 0.006))


def _lowered(surface: Surface, by_m: float = 0.15) -> Surface:
    vertices = surface.vertices_m - np.array([0.0, 0.0, by_m])
    return Surface(surface.finish, vertices, surface.quads, surface.uvs_m, surface.smooth)


def _kept(copies: Copies, mask: npt.NDArray[np.bool_]) -> Copies:
    return Copies(copies.surfaces, copies.at_m[mask], copies.turns_rad[mask], copies.sizes[mask])


def _behind(copies: Copies, shore_deg: float) -> Copies:
    """Drop what would stand in the water."""
    angle = math.radians(shore_deg)
    across = copies.at_m[:, 0] * math.cos(angle) + copies.at_m[:, 1] * math.sin(angle)
    return _kept(copies, across < 0.5)


def _beyond(copies: Copies, y_m: float, low_m: float | None = None) -> Copies:
    """Drop what would stand on a path or a terrace between two y."""
    y = copies.at_m[:, 1]
    return _kept(copies, (y > y_m) | (y < (-y_m if low_m is None else low_m)))


def _beside(copies: Copies, y_m: float) -> Copies:
    """Move copies to the two sides of a street."""
    at = copies.at_m.copy()
    at[:, 1] = np.where(at[:, 1] > 0, y_m, -y_m)
    return Copies(copies.surfaces, at, copies.turns_rad, copies.sizes)
