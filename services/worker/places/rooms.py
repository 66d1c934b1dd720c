"""Rooms: shells with doors, the light that is switched on, and pot plants."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from services.worker.places.place import (
    AreaLamp,
    Finish,
    Pattern,
    Point,
    PointLamp,
    Rgb,
    Surface,
    rgb_of,
)
from services.worker.places.shapes import box, boxes, lathe, leaves, moved, rod

WARM: Rgb = (1.0, 0.62, 0.30)
SOFT: Rgb = (1.0, 0.80, 0.58)
COLD: Rgb = (0.82, 0.95, 1.0)

WHITE = Finish(Pattern.PLAIN, (0.72, 0.71, 0.68), roughness=0.6)
DARK_WOOD = Finish(Pattern.PLANKS, (0.085, 0.045, 0.024), (0.13, 0.075, 0.042), 0.14, 0.45)
OAK = Finish(Pattern.PLANKS, (0.34, 0.21, 0.11), (0.42, 0.28, 0.16), 0.12, 0.42)
PINE = Finish(Pattern.PLANKS, (0.47, 0.33, 0.19), (0.54, 0.40, 0.25), 0.16, 0.5)
STEEL = Finish(Pattern.PLAIN, (0.55, 0.55, 0.56), roughness=0.32, metallic=1.0)
BLACK = Finish(Pattern.PLAIN, (0.02, 0.02, 0.022), roughness=0.45)
MARBLE = Finish(Pattern.VEINS, (0.70, 0.69, 0.67), (0.40, 0.39, 0.38), 0.35, 0.18)

FLOORS: tuple[Finish, ...] = (
    OAK,
    DARK_WOOD,
    PINE,
    Finish(Pattern.TILES, (0.50, 0.47, 0.42), (0.27, 0.25, 0.23), 0.45, 0.42),
    Finish(Pattern.TILES, (0.16, 0.16, 0.165), (0.06, 0.06, 0.06), 0.6, 0.42),
    Finish(Pattern.MOTTLED, (0.16, 0.17, 0.20), (0.20, 0.21, 0.24), 0.03, 1.0),
    Finish(Pattern.MOTTLED, (0.36, 0.31, 0.25), (0.44, 0.39, 0.32), 0.04, 1.0),
    Finish(Pattern.MOTTLED, (0.27, 0.265, 0.255), (0.36, 0.35, 0.34), 1.1, 0.35),
    Finish(Pattern.TILES, (0.34, 0.15, 0.09), (0.30, 0.26, 0.22), 0.25, 0.5),
)
WALLS: tuple[Rgb, ...] = (
    (0.74, 0.67, 0.53),
    (0.68, 0.56, 0.38),
    (0.28, 0.46, 0.54),
    (0.42, 0.53, 0.33),
    (0.68, 0.42, 0.32),
    (0.14, 0.23, 0.38),
    (0.70, 0.55, 0.20),
    (0.44, 0.14, 0.10),
    (0.54, 0.67, 0.74),
    (0.15, 0.33, 0.22),
)
_UNFOLLOWED = 0.6**3
"""Share of the lamps' light still in a room of mean reflectance 0.6 after the bounces that a bake
follows; it is given to the room evenly, and bounces on."""


@dataclass(frozen=True)
class Shell:
    """A room's inside: x from 0 to length, y from 0 to width, z from 0 to height, metres."""

    length_m: float
    width_m: float
    height_m: float
    floor: Finish
    wall_rgb: Rgb
    accent_rgb: Rgb
    skirting: bool = True
    ceiling_rgb: Rgb = (0.74, 0.73, 0.71)

    def surfaces(self) -> list[Surface]:
        """Return floor, ceiling, walls (the one at y = width in the accent) and skirting."""
        x, y, z, t = self.length_m, self.width_m, self.height_m, 0.2
        wall = Finish(Pattern.MOTTLED, times(self.wall_rgb, 0.95), self.wall_rgb, 1.2, 0.85)
        accent = Finish(Pattern.MOTTLED, times(self.accent_rgb, 0.94), self.accent_rgb, 1.2, 0.85)
        ceiling = Finish(Pattern.PLAIN, self.ceiling_rgb, roughness=0.95)
        parts = [
            box(self.floor, (-t, -t, -t), (x + t, y + t, 0.0)),
            box(ceiling, (-t, -t, z), (x + t, y + t, z + t)),
            boxes(
                wall,
                [((-t, -t, 0), (x + t, 0, z)), ((-t, 0, 0), (0, y, z)), ((x, 0, 0), (x + t, y, z))],
            ),
            box(accent, (-t, y, 0), (x + t, y + t, z)),
        ]
        if self.skirting:
            h, d = 0.09, 0.018
            strips = [
                ((0, 0, 0), (x, d, h)),
                ((0, y - d, 0), (x, y, h)),
                ((0, 0, 0), (d, y, h)),
                ((x - d, 0, 0), (x, y, h)),
            ]
            parts.append(
                boxes(WHITE, [((a[0], a[1], a[2]), (b[0], b[1], b[2])) for a, b in strips])
            )
        return parts


@dataclass(frozen=True, eq=False)
class Fitted:
    """Things and the light they give."""

    surfaces: tuple[Surface, ...]
    area: tuple[AreaLamp, ...] = ()
    points: tuple[PointLamp, ...] = ()


def last_bounces(
    shell: Shell, area: Sequence[AreaLamp], points: Sequence[PointLamp]
) -> tuple[AreaLamp, AreaLamp]:
    """Return the even light of the bounces that are not followed, from ceiling and floor."""
    power = np.zeros(3)
    for lamp in area:  # a narrower spread does not change a lamp's power
        power += math.pi * lamp.width_m * lamp.height_m * np.array(lamp.radiance)
    for bulb in points:
        power += 4.0 * math.pi * np.array(bulb.intensity)
    x, y, z = shell.length_m, shell.width_m, shell.height_m
    radiance = rgb_of(_UNFOLLOWED * power / (2.0 * math.pi * x * y))
    size = (x - 0.02, y - 0.02)
    return (
        AreaLamp((x / 2.0, y / 2.0, z - 0.03), (0.0, 0.0, -1.0), *size, radiance),
        AreaLamp((x / 2.0, y / 2.0, 0.03), (0.0, 0.0, 1.0), *size, radiance),
    )


def door(wall: str, shell: Shell, middle_m: float, finish: Finish) -> Fitted:
    """Return a door leaf with panels, frame and handle."""

    def put(what: Finish, u0: float, u1: float, z0: float, z1: float, d1: float) -> Surface:
        return box(what, *on_wall(wall, shell, middle_m + u0, middle_m + u1, z0, z1, 0.0, d1))

    frame = [
        put(WHITE, -0.53, -0.45, 0.0, 2.13, 0.035),
        put(WHITE, 0.45, 0.53, 0.0, 2.13, 0.035),
        put(WHITE, -0.53, 0.53, 2.05, 2.13, 0.035),
    ]
    leaf = [put(finish, -0.45, 0.45, 0.0, 2.05, 0.018)]
    panels = [put(finish, -0.33, 0.33, z0, z1, 0.03) for z0, z1 in ((0.2, 0.9), (1.1, 1.85))]
    return Fitted((*frame, *leaf, *panels, put(STEEL, 0.34, 0.40, 1.0, 1.03, 0.08)))


def ceiling_panel(
    x: float, y: float, shell: Shell, size: tuple[float, float], radiance: Rgb
) -> Fitted:
    """Return a flat lamp in the ceiling."""
    z, (w, h) = shell.height_m, (size[0] / 2.0, size[1] / 2.0)
    face = box(glow(radiance), (x - w, y - h, z - 0.012), (x + w, y + h, z - 0.01))
    rim = box(WHITE, (x - w - 0.02, y - h - 0.02, z - 0.01), (x + w + 0.02, y + h + 0.02, z))
    lamp = AreaLamp((x, y, z - 0.02), (0.0, 0.0, -1.0), size[0], size[1], radiance)
    return Fitted((face, rim), (lamp,))


def pendant(x: float, y: float, shell: Shell, drop_m: float, radiance: Rgb) -> Fitted:
    """Return a lamp that hangs from the ceiling."""
    z = shell.height_m - drop_m
    shade = Finish(Pattern.PLAIN, (0.05, 0.05, 0.05), roughness=0.4)
    cord = rod(BLACK, (x, y, z + 0.2), drop_m - 0.2, (0.006, 0.006), 6)
    hood = lathe(shade, (x, y, z), [(0.22, 0.0), (0.2, 0.06), (0.1, 0.18), (0.02, 0.22)])
    bulb = lathe(glow(times(radiance, 4.0)), (x, y, z), [(0.001, -0.02), (0.06, 0.0), (0.05, 0.06)])
    return Fitted(
        (cord, hood, bulb), (), (PointLamp((x, y, z - 0.07), 0.06, times(radiance, 0.22)),)
    )


def floor_lamp(x: float, y: float, radiance: Rgb) -> Fitted:
    """Return a standing lamp with a cloth shade."""
    post = rod(BLACK, (x, y, 0.0), 1.5, (0.012, 0.012), 8)
    foot = rod(BLACK, (x, y, 0.0), 0.03, (0.15, 0.14))
    shade = lathe(glow(times(radiance, 1.3)), (x, y, 1.4), [(0.22, 0.0), (0.16, 0.3)])
    return Fitted((post, foot, shade), (), (PointLamp((x, y, 1.55), 0.17, times(radiance, 0.16)),))


def table_lamp(x: float, y: float, z: float, radiance: Rgb) -> Fitted:
    """Return a small lamp for a table or a shelf."""
    pot = Finish(Pattern.PLAIN, (0.2, 0.28, 0.27), roughness=0.25)
    foot = lathe(pot, (x, y, z), [(0.06, 0), (0.08, 0.08), (0.03, 0.2), (0.01, 0.26)])
    shade = lathe(glow(times(radiance, 1.3)), (x, y, z + 0.24), [(0.15, 0.0), (0.1, 0.2)])
    return Fitted((foot, shade), (), (PointLamp((x, y, z + 0.34), 0.1, times(radiance, 0.07)),))


def plant(x: float, y: float, z: float, size: float, rng: np.random.Generator) -> Fitted:
    """Return a pot plant."""
    pot = Finish(Pattern.MOTTLED, (0.34, 0.16, 0.09), (0.40, 0.21, 0.13), 0.1, 0.85)
    if rng.random() < 0.5:
        pot = Finish(Pattern.PLAIN, (0.6, 0.6, 0.58), roughness=0.3)
    body = lathe(pot, (0, 0, 0), [(0.12, 0), (0.17, 0.28), (0.18, 0.3), (0.15, 0.3), (0.02, 0.27)])
    green = Finish(Pattern.LEAVES, (0.02, 0.07, 0.015), (0.07, 0.16, 0.04))
    crown = moved(leaves(green, rng, 420, (0.34, 0.34, 0.42), 0.085), (0, 0, 0.72))
    stem = rod(DARK_WOOD, (0, 0, 0.2), 0.5, (0.015, 0.01), 6)
    return Fitted(tuple(moved(part, (x, y, z), 0.0, size) for part in (body, stem, crown)))


def on_wall(
    wall: str, shell: Shell, u0: float, u1: float, z0: float, z1: float, d0: float, d1: float
) -> tuple[Point, Point]:
    """Return the corners of a box along a wall: u along it, d into the room."""
    x, y = shell.length_m, shell.width_m
    if wall == "x0":
        return (d0, u0, z0), (d1, u1, z1)
    if wall == "x1":
        return (x - d1, u0, z0), (x - d0, u1, z1)
    if wall == "y0":
        return (u0, d0, z0), (u1, d1, z1)
    return (u0, y - d1, z0), (u1, y - d0, z1)


def wall_point(wall: str, shell: Shell, u: float, z: float, d: float) -> Point:
    """Return a point u along a wall, z up, d into the room."""
    low, _ = on_wall(wall, shell, u, u, z, z, d, d)
    return low


def inward(wall: str) -> Point:
    """Return the unit vector from a wall into the room."""
    return {"x0": (1.0, 0, 0), "x1": (-1.0, 0, 0), "y0": (0, 1.0, 0), "y1": (0, -1.0, 0)}[wall]


def glow(rgb: Rgb) -> Finish:
    """Return what radiates a colour."""
    return Finish(Pattern.GLOW, rgb)


def times(rgb: Rgb, factor: float) -> Rgb:
    """Return a colour made brighter or darker."""
    return (rgb[0] * factor, rgb[1] * factor, rgb[2] * factor)


def blend(first: Rgb, second: Rgb, t: float) -> Rgb:
    """Return a colour between two."""
    a, b = times(first, 1.0 - t), times(second, t)
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
