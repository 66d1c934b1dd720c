"""What hangs on walls and stands against them: each along a wall of a shell, u metres along it."""

from collections.abc import Callable

import numpy as np

from services.worker.places.place import Finish, Pattern, PointLamp, Rgb, Surface, vivid
from services.worker.places.rooms import (
    BLACK,
    OAK,
    STEEL,
    WHITE,
    Fitted,
    Shell,
    glow,
    on_wall,
    times,
    wall_point,
)
from services.worker.places.shapes import ball, box, boxes, lathe, leaves, moved

_Put = Callable[[Finish, float, float, float, float, float, float], Surface]


def picture(
    wall: str,
    shell: Shell,
    middle_m: float,
    z_m: float,
    size: tuple[float, float],
    rng: np.random.Generator,
) -> Fitted:
    """Return a framed painting."""
    rgb, other = vivid(rng, 0.02, 0.65), vivid(rng, 0.02, 0.65)
    paint = Finish(Pattern.PICTURE, rgb, other, 0.22, 0.6)
    frame = (BLACK, OAK, WHITE)[int(rng.integers(0, 3))]
    w, h = size[0] / 2.0, size[1] / 2.0

    def put(what: Finish, a: float, b: float, d: float) -> Surface:
        low, high = middle_m - a, middle_m + a
        return box(what, *on_wall(wall, shell, low, high, z_m - b, z_m + b, 0.0, d))

    return Fitted(
        (
            put(frame, w + 0.03, h + 0.03, 0.025),
            put(WHITE, w, h, 0.027),
            put(paint, 0.84 * w, 0.84 * h, 0.029),
        )
    )


def gallery(wall: str, shell: Shell, low: float, high: float, rng: np.random.Generator) -> Fitted:
    """Return pictures of several sizes side by side and above each other, between two points."""
    surfaces: list[Surface] = []
    at = low
    while at < high - 0.3:
        wide = float(rng.uniform(0.3, min(0.8, high - at)))
        stacked = wide < 0.5 and rng.random() < 0.6
        for z in (1.25, 1.78) if stacked else (1.55,):
            tall = 0.4 if stacked else float(rng.uniform(0.5, 0.9))
            surfaces += picture(wall, shell, at + wide / 2.0, z, (wide, tall), rng).surfaces
        at += wide + float(rng.uniform(0.12, 0.25))
    return Fitted(tuple(surfaces))


def wall_shelf(
    wall: str, shell: Shell, middle_m: float, z_m: float, width_m: float, rng: np.random.Generator
) -> Fitted:
    """Return a board with books, pots and a trailing plant."""
    put = _putting(wall, shell)
    low, high = middle_m - width_m / 2.0, middle_m + width_m / 2.0
    parts = [put(OAK, low, high, z_m - 0.025, z_m, 0.0, 0.22)]
    u = low + 0.04
    while u < high - 0.1:
        if rng.random() < 0.2:
            parts += _pot(wall, shell, u + 0.07, z_m, rng)
            u += 0.2
            continue
        thick, tall = float(rng.uniform(0.015, 0.045)), float(rng.uniform(0.16, 0.27))
        cover = Finish(Pattern.PLAIN, vivid(rng, 0.03, 0.6), roughness=0.6)
        parts.append(put(cover, u, u + thick, z_m, z_m + tall, 0.03, 0.18))
        u += thick + (0.001 if rng.random() < 0.9 else 0.15)
    return Fitted(tuple(parts))


def _pot(wall: str, shell: Shell, u: float, z: float, rng: np.random.Generator) -> list[Surface]:
    glaze = Finish(Pattern.PLAIN, vivid(rng, 0.1, 0.7), roughness=0.3)
    green = Finish(Pattern.LEAVES, (0.025, 0.08, 0.02), (0.09, 0.2, 0.05))
    at = wall_point(wall, shell, u, z, 0.12)
    crown = leaves(green, rng, 90, (0.12, 0.12, 0.12), 0.035)
    return [
        lathe(glaze, at, [(0.045, 0.0), (0.06, 0.11), (0.05, 0.11), (0.01, 0.09)]),
        moved(crown, (at[0], at[1], at[2] + 0.19)),
    ]


def sideboard(
    wall: str, shell: Shell, middle_m: float, width_m: float, rng: np.random.Generator
) -> Fitted:
    """Return a low painted cupboard with vases and books on it."""
    put = _putting(wall, shell)
    low, high = middle_m - width_m / 2.0, middle_m + width_m / 2.0
    body = Finish(Pattern.PLAIN, vivid(rng, 0.12, 0.55), roughness=0.5)
    parts = [put(body, low, high, 0.1, 0.8, 0.0, 0.4), put(OAK, low, high, 0.8, 0.83, 0.0, 0.42)]
    doors = max(round(width_m / 0.5), 1)
    for door in range(doors):
        a = low + width_m * door / doors
        b = low + width_m * (door + 1) / doors
        parts.append(put(body, a + 0.01, b - 0.01, 0.13, 0.77, 0.4, 0.415))
        parts.append(put(STEEL, b - 0.07, b - 0.05, 0.5, 0.62, 0.415, 0.435))
    for number in range(4):
        u = low + width_m * (0.14 + 0.24 * number)
        if number % 2:
            parts += _pot(wall, shell, u, 0.83, rng)
        else:
            parts += _vase(wall, shell, u, rng)
    return Fitted(tuple(parts))


def _vase(wall: str, shell: Shell, u: float, rng: np.random.Generator) -> list[Surface]:
    glaze = Finish(Pattern.PLAIN, vivid(rng, 0.05, 0.75), roughness=0.2)
    tall = float(rng.uniform(0.2, 0.4))
    profile = [(0.05, 0.0), (0.1, tall * 0.35), (0.04, tall * 0.85), (0.055, tall)]
    return [lathe(glaze, wall_point(wall, shell, u, 0.83, 0.2), profile)]


def pinboard(
    wall: str, shell: Shell, middle_m: float, width_m: float, rng: np.random.Generator
) -> Fitted:
    """Return a board of cork with many coloured papers, no lettering."""
    put = _putting(wall, shell)
    low, high = middle_m - width_m / 2.0, middle_m + width_m / 2.0
    cork = Finish(Pattern.MOTTLED, (0.36, 0.23, 0.12), (0.46, 0.31, 0.17), 0.03, 0.95)
    parts = [
        put(OAK, low - 0.03, high + 0.03, 1.02, 1.98, 0.0, 0.02),
        put(cork, low, high, 1.05, 1.95, 0.0, 0.025),
    ]
    papers = [Finish(Pattern.PLAIN, vivid(rng, 0.2, 0.85), roughness=0.9) for _ in range(6)]
    papers += [Finish(Pattern.PLAIN, (0.78, 0.77, 0.72), roughness=0.9)] * 3
    for row in range(2):
        u = low + 0.05
        while u < high - 0.25:
            wide, tall = float(rng.uniform(0.12, 0.26)), float(rng.uniform(0.2, 0.36))
            z = 1.1 + 0.42 * row + float(rng.uniform(0.0, 0.05))
            paper = papers[int(rng.integers(0, len(papers)))]
            parts.append(put(paper, u, u + wide, z, z + tall, 0.0, 0.03))
            u += wide + float(rng.uniform(0.03, 0.12))
    return Fitted(tuple(parts))


def lockers(wall: str, shell: Shell, low: float, high: float, rgb: Rgb) -> Fitted:
    """Return a row of metal lockers, every second one of a lighter shade."""
    put = _putting(wall, shell)
    shades = [Finish(Pattern.PLAIN, times(rgb, k), roughness=0.4) for k in (1.0, 1.5)]
    count = max(round((high - low) / 0.4), 1)
    each = (high - low) / count
    parts = [put(BLACK, low, high, 0.0, 1.9, 0.0, 0.36)]
    for number in range(count):
        u = low + number * each
        parts.append(put(shades[number % 2], u + 0.008, u + each - 0.008, 0.1, 1.88, 0.36, 0.38))
        parts.append(put(STEEL, u + each - 0.07, u + each - 0.05, 1.0, 1.14, 0.38, 0.4))
        vents = [
            on_wall(wall, shell, u + 0.1, u + each - 0.1, z, z + 0.015, 0.38, 0.383)
            for z in (1.6, 1.65, 1.7)
        ]
        parts.append(boxes(BLACK, vents))
    return Fitted(tuple(parts))


def clock(wall: str, shell: Shell, middle_m: float, z_m: float) -> Fitted:
    """Return a round clock: a face and two hands, no figures."""
    put = _putting(wall, shell)
    hands = [
        put(BLACK, middle_m - 0.006, middle_m + 0.006, z_m, z_m + 0.1, 0.0, 0.034),
        put(BLACK, middle_m, middle_m + 0.08, z_m - 0.006, z_m + 0.006, 0.0, 0.034),
    ]
    at = wall_point(wall, shell, middle_m, z_m, 0.0)
    return Fitted((_disc(BLACK, wall, at, 0.175, 0.02), _disc(WHITE, wall, at, 0.16, 0.03), *hands))


def _disc(
    finish: Finish, wall: str, at: tuple[float, float, float], radius: float, deep: float
) -> Surface:
    flat = ball(finish, (0.0, 0.0, 0.0), 1.0)
    size = (deep, radius, radius) if wall[0] == "x" else (radius, deep, radius)
    vertices = flat.vertices_m * np.array(size) + np.array(at)
    return Surface(finish, vertices, flat.quads, flat.uvs_m, smooth=True)


def radiator(wall: str, shell: Shell, middle_m: float, width_m: float) -> Fitted:
    """Return a radiator as it hangs below a window."""
    low, ribs = middle_m - width_m / 2.0, round(width_m / 0.06)
    bars = [
        on_wall(wall, shell, low + 0.06 * rib, low + 0.06 * rib + 0.045, 0.12, 0.68, 0.04, 0.12)
        for rib in range(ribs)
    ]
    bars.append(on_wall(wall, shell, low, low + 0.06 * ribs, 0.18, 0.24, 0.05, 0.1))
    return Fitted((boxes(WHITE, bars),))


def coats(wall: str, shell: Shell, middle_m: float, rng: np.random.Generator) -> Fitted:
    """Return a board of hooks with coats and a bag."""
    put = _putting(wall, shell)
    parts = [put(OAK, middle_m - 0.5, middle_m + 0.5, 1.66, 1.76, 0.0, 0.025)]
    for number in range(3):
        rgb = vivid(rng, 0.03, 0.45)
        stuff = Finish(Pattern.MOTTLED, times(rgb, 0.8), rgb, 0.03, 1.0)
        at = wall_point(wall, shell, middle_m - 0.32 + 0.32 * number, 0.72, 0.12)
        drop = 0.95 if number < 2 else 0.6
        profile = [(0.17, 0.95 - drop), (0.16, 0.5), (0.13, 0.85), (0.03, 0.97)]
        parts.append(lathe(stuff, at, profile))
    return Fitted(tuple(parts))


def wainscot(shell: Shell, rgb: Rgb, height_m: float) -> Fitted:
    """Return the lower part of all walls in a colour of its own, with a ledge along its top."""
    finish = Finish(Pattern.MOTTLED, times(rgb, 0.95), rgb, 0.9, 0.6)
    x, y, d = shell.length_m, shell.width_m, 0.006
    walls = [("y0", x), ("y1", x), ("x0", y), ("x1", y)]
    panels = [on_wall(w, shell, 0.0, long, 0.0, height_m, 0.0, d) for w, long in walls]
    ledge = [
        on_wall(w, shell, 0.0, long, height_m, height_m + 0.04, 0.0, 0.016) for w, long in walls
    ]
    return Fitted((boxes(finish, panels), boxes(WHITE, ledge)))


def wall_lamp(wall: str, shell: Shell, u: float, z: float, radiance: Rgb) -> Fitted:
    """Return a bowl that lights the wall above it."""
    at = wall_point(wall, shell, u, z, 0.13)
    bowl = lathe(glow(radiance), at, [(0.03, -0.08), (0.09, 0.0), (0.11, 0.05)])
    lit = PointLamp((at[0], at[1], at[2] + 0.07), 0.07, times(radiance, 0.05))
    return Fitted((bowl,), (), (lit,))


def _putting(wall: str, shell: Shell) -> _Put:
    def put(
        finish: Finish, u0: float, u1: float, z0: float, z1: float, d0: float, d1: float
    ) -> Surface:
        return box(finish, *on_wall(wall, shell, u0, u1, z0, z1, d0, d1))

    return put
