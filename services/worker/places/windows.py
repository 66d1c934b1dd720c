"""Windows: what is seen through them, the light of sky and ground, and the sun's patch."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from services.worker.places.place import AreaLamp, Finish, Point, Rgb, Surface
from services.worker.places.rooms import (
    WHITE,
    Fitted,
    Shell,
    blend,
    glow,
    inward,
    on_wall,
    times,
    wall_point,
)
from services.worker.places.shapes import box, boxes, grid_quads

_DAY: Rgb = (0.88, 0.96, 1.06)
_LOW_SUN: Rgb = (1.0, 0.72, 0.45)
_SUN_SPREAD_DEG = 2.5
_SKY_SPREAD_DEG, _GROUND_SPREAD_DEG = 136.0, 120.0


@dataclass(frozen=True)
class Daylight:
    """What stands in the windows: radiance of sky, of trees far away, of ground; and the sun.

    `sun` is the irradiance, face on, of the beam along `way`.
    """

    sky: Rgb
    trees: Rgb
    ground: Rgb
    sun: Rgb = (0.0, 0.0, 0.0)
    way: Point = (-0.62, 0.36, -0.70)


def daylight(kind: str) -> Daylight:
    """Return noon, dull, low (a low sun's warm light), dusk or night."""
    return {
        "noon": Daylight(
            times(_DAY, 10.0), (0.42, 0.62, 0.22), (1.7, 1.9, 1.1), (74.0, 66.0, 54.0)
        ),
        "dull": Daylight(times((0.95, 0.99, 1.04), 6.0), (0.36, 0.46, 0.26), (1.1, 1.2, 0.9)),
        "low": Daylight(
            times(_LOW_SUN, 6.0),
            (0.5, 0.42, 0.16),
            (1.8, 1.3, 0.7),
            (60.0, 34.0, 14.0),
            (-0.84, 0.38, -0.38),
        ),
        "dusk": Daylight((0.17, 0.24, 0.42), (0.02, 0.025, 0.03), (0.03, 0.035, 0.05)),
        "night": Daylight((0.003, 0.0036, 0.0055), (0.001, 0.001, 0.0012), (0.006, 0.004, 0.002)),
    }[kind]


def window(
    wall: str,
    shell: Shell,
    middle_m: float,
    width_m: float,
    day: Daylight,
    *,
    heights_m: tuple[float, float] = (0.85, 2.25),
    curtain: Finish | None = None,
    panes: int = 2,
) -> Fitted:
    """Return a window on a wall ("x0", "x1", "y0", "y1"): outlook, frame, sill, curtains, light."""
    low, high = middle_m - width_m / 2.0, middle_m + width_m / 2.0
    sill_m, top = heights_m[0], min(heights_m[1], shell.height_m - 0.15)
    parts = [
        *_outlook(wall, shell, low, high, sill_m, top, day),
        *_frame(wall, shell, low, high, sill_m, top, panes),
    ]
    if curtain is not None:
        parts += [_curtain(wall, shell, curtain, low - 0.35, low + 0.12, top + 0.2)]
        parts += [_curtain(wall, shell, curtain, high - 0.12, high + 0.35, top + 0.2)]
    return Fitted(tuple(parts), _light(wall, shell, middle_m, width_m, sill_m, top, day))


def _light(
    wall: str, shell: Shell, middle: float, width: float, sill: float, top: float, day: Daylight
) -> tuple[AreaLamp, ...]:
    """The sky shines down, the ground up: a lamp each, so that no ceiling burns above a window."""
    x, y, _ = inward(wall)
    at = wall_point(wall, shell, middle, (sill + top) / 2.0, 0.08)
    size = (width, top - sill)
    sky = times(blend(day.sky, day.trees, 0.3), 1.25)
    lamps = [
        AreaLamp(at, (x, y, -0.62), *size, sky, _SKY_SPREAD_DEG),
        AreaLamp(at, (x, y, 0.35), *size, times(day.ground, 0.5), _GROUND_SPREAD_DEG),
    ]
    facing = x * day.way[0] + y * day.way[1]
    if max(day.sun) > 0.0 and facing > 0.2:
        # Blender keeps a lamp's power when its spread narrows: irradiance is pi x this radiance.
        beam = times(day.sun, facing / math.pi)
        pane = wall_point(wall, shell, middle, (sill + top) / 2.0, 0.006)
        lamps.append(AreaLamp(pane, day.way, *size, beam, _SUN_SPREAD_DEG))
    return tuple(lamps)


def _outlook(
    wall: str, shell: Shell, low: float, high: float, sill: float, top: float, day: Daylight
) -> list[Surface]:
    """Sky, paler at the horizon, with a line of trees before it and ground below."""
    horizon = sill + (top - sill) * 0.36

    def put(rgb: Rgb, z0: float, z1: float) -> Surface:
        return box(glow(rgb), *on_wall(wall, shell, low, high, z0, z1, -0.02, 0.003))

    middle = horizon + 0.45 * (top - horizon)
    pale = blend(times(day.sky, 1.25), (sum(day.sky) / 2.4,) * 3, 0.4)
    edges = np.linspace(low, high, max(round((high - low) / 0.03), 2))
    crowns = []
    for a, b in itertools.pairwise(edges.tolist()):
        tall = (
            0.55
            + 0.3 * math.sin(5.1 * a + 1.3)
            + 0.22 * math.sin(13.7 * a)
            + 0.1 * math.sin(41 * a)
        )
        high_m = horizon + 0.34 * (top - horizon) * max(tall, 0.12)
        crowns.append(on_wall(wall, shell, a, b, horizon - 0.03, high_m, -0.01, 0.0045))
    return [
        put(day.sky, middle, top),
        put(pale, horizon, middle),
        put(day.ground, sill, horizon),
        boxes(glow(day.trees), crowns),
    ]


def _frame(
    wall: str, shell: Shell, low: float, high: float, sill: float, top: float, panes: int
) -> list[Surface]:
    def put(u0: float, u1: float, z0: float, z1: float, d1: float) -> tuple[Point, Point]:
        return on_wall(wall, shell, u0, u1, z0, z1, 0.0, d1)

    bars = [put(low - 0.12, high + 0.12, sill - 0.05, sill, 0.17)]
    for part in range(panes + 1):
        u = low + (high - low) * part / panes
        bars.append(put(u - 0.03, u + 0.03, sill, top, 0.05))
    cross = sill + 0.62 * (top - sill)
    bars += [put(low - 0.03, high + 0.03, z - 0.03, z + 0.03, 0.05) for z in (sill, top, cross)]
    return [boxes(WHITE, bars)]


def _curtain(
    wall: str, shell: Shell, finish: Finish, low: float, high: float, top: float
) -> Surface:
    u = np.linspace(low, high, 40)
    depth = 0.09 + 0.03 * np.sin((u - low) * 55.0)
    points = [
        wall_point(wall, shell, float(a), z, float(d))
        for z in (0.04, top)
        for a, d in zip(u, depth, strict=True)
    ]
    vertices = np.array(points)
    quads = grid_quads(2, 40)
    return Surface(finish, vertices, quads, np.zeros((len(quads), 4, 2)), smooth=True)
