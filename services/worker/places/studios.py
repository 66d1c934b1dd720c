"""Studio set-ups: backdrops, softboxes, rings, rims, coves, grey and white rooms."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from services.worker.places import furniture as f
from services.worker.places import rooms as r
from services.worker.places.place import (
    AreaLamp,
    Finish,
    Pattern,
    Place,
    Point,
    PointLamp,
    Rgb,
    Surface,
    vivid,
)
from services.worker.places.shapes import box, grid_quads, lathe, moved, rod

BACKDROPS: Mapping[str, Rgb] = MappingProxyType(
    {
        "white": (0.78, 0.78, 0.77),
        "grey": (0.18, 0.18, 0.18),
        "black": (0.018, 0.018, 0.02),
        "blue": (0.04, 0.10, 0.28),
        "green": (0.03, 0.26, 0.07),
        "rust": (0.36, 0.12, 0.05),
        "sand": (0.50, 0.40, 0.28),
        "teal": (0.02, 0.20, 0.21),
        "plum": (0.20, 0.06, 0.18),
        "mustard": (0.50, 0.32, 0.05),
        "rose": (0.55, 0.30, 0.30),
        "sky": (0.32, 0.50, 0.62),
    }
)
SETUPS: Mapping[str, str] = MappingProxyType(
    {
        "two_softboxes": "two softboxes at 45 degrees",
        "one_softbox": "one softbox from the side",
        "umbrella": "an umbrella from above",
        "ring": "a ring light",
        "rims": "two strip lights from behind",
        "cove": "a white cove lit from all sides",
        "grey_room": "a grey room with an even ceiling",
        "gels": "two lamps with coloured filters",
        "spot": "one hard spot",
        "table": "a product table between two panels",
    }
)


_DARK = ("rims", "gels", "spot")


def studio(rng: np.random.Generator, setup: str, backdrop: str) -> Place:
    """Return a studio room around the eye with a backdrop and one of the SETUPS."""
    rgb = BACKDROPS[backdrop]
    if setup in ("cove", "grey_room"):
        return _even_room(rng, setup, rgb)
    size = (float(rng.uniform(6.5, 8.5)), float(rng.uniform(5.5, 7.0)), 3.2)
    dark = setup in _DARK
    walls = _wall_rgb(rgb, dark=dark)
    floor = r.FLOORS[int(rng.choice([1, 4, 7, 0]))]
    shell = r.Shell(
        *size, floor, walls, walls, ceiling_rgb=(0.08, 0.08, 0.08) if dark else (0.6, 0.6, 0.6)
    )
    x, y = size[0], size[1]
    side = 1.0 if rng.random() < 0.5 else -1.0
    parts = [*shell.surfaces(), *_roll(rgb, x - 0.5, y / 2.0), *_gear(rng, x, y)]
    parts += _boards(rgb, x, y, side)
    lamps, boxes_, points = _LIGHTS[setup](x, y, side)
    parts += boxes_
    if setup not in ("rims", "spot"):
        lamps.append(_on_paper(x, y, lamps))
    lamps += r.last_bounces(shell, lamps, points)
    return Place(tuple(parts), (x * 0.42, y * 0.5, 1.4), (), tuple(lamps), tuple(points))


def _wall_rgb(rgb: Rgb, *, dark: bool) -> Rgb:
    """Return walls painted like the paper, duller; a studio of lights in the dark has dark ones."""
    grey = (0.42, 0.41, 0.40)
    tinted = r.blend(rgb, grey, 0.3)
    return r.times(r.blend(rgb, (0.12, 0.12, 0.12), 0.5), 0.45) if dark else tinted


def _boards(rgb: Rgb, x: float, y: float, side: float) -> list[Surface]:
    """Return tall boards that lean about: one in the paper's colour, a white and a black one."""
    parts = []
    for number, (colour, at) in enumerate(
        (
            (rgb, (x * 0.30, y * 0.5 - side * (y * 0.5 - 0.25))),
            ((0.72, 0.72, 0.70), (0.35, y * 0.5 + side * y * 0.30)),
            ((0.03, 0.03, 0.032), (0.28, y * 0.5 + side * y * 0.10)),
            (r.times(rgb, 0.8), (x * 0.62, y * 0.5 + side * (y * 0.5 - 0.2))),
        )
    ):
        finish = Finish(Pattern.MOTTLED, r.times(colour, 0.95), colour, 1.5, 0.9)
        turn = 0.12 if number in (0, 3) else math.pi / 2.0 - 0.12
        board = box(finish, (-0.6, -0.02, 0.02), (0.6, 0.02, 2.35))
        parts.append(moved(board, (*at, 0.0), turn))
    return parts


def _on_paper(x: float, y: float, lamps: list[AreaLamp]) -> AreaLamp:
    """Return a lamp above the eye that lights the paper alone, as bright as the main light."""
    main = max(lamps, key=lambda lamp: sum(lamp.radiance) * lamp.width_m * lamp.height_m)
    share = main.width_m * main.height_m / (1.6 * 0.4) * 0.55
    at = (x * 0.58, y / 2.0, 3.05)
    return AreaLamp(at, (0.75, 0.0, -0.5), 1.6, 0.4, r.times(main.radiance, share), 90.0)


def _even_room(rng: np.random.Generator, setup: str, rgb: Rgb) -> Place:
    size = (7.0, 7.0, 3.6)
    finish = Finish(Pattern.MOTTLED, r.times(rgb, 0.97), rgb, 2.0, 0.8)
    shell = r.Shell(*size, finish, rgb, rgb, skirting=False, ceiling_rgb=(0.6, 0.6, 0.6))
    parts = [*shell.surfaces(), *_coved(rgb, size[0], size[1])]
    fitted = []
    power = r.times((1.0, 0.97, 0.92), 3.0 if setup == "cove" else 2.0)
    spots = [(1.4, 1.6), (1.4, 5.4), (5.6, 1.6), (5.6, 5.4), (3.5, 3.5)]
    if setup == "grey_room":
        spots = [(2.0, 3.5), (5.2, 3.5)]
    for at_x, at_y in spots:
        wide = (1.6, 1.0) if setup == "cove" else (2.0, 2.6)
        fitted.append(r.ceiling_panel(at_x, at_y, shell, wide, power))
    parts += [part for fit in fitted for part in fit.surfaces]
    if setup == "grey_room":
        parts += _card(4.9, 2.0, float(rng.uniform(60.0, 120.0)))
        parts += _gear(rng, size[0], size[1])
    else:
        stand = Finish(Pattern.PLAIN, (0.62, 0.62, 0.62), roughness=0.5)
        parts += [
            box(stand, (4.6, 1.2, 0.0), (5.2, 1.8, 0.7)),
            box(stand, (4.9, 5.0, 0.0), (5.3, 5.4, 1.0)),
        ]
        parts += _props(rng)
    area = [lamp for fit in fitted for lamp in fit.area]
    area += r.last_bounces(shell, area, ())
    return Place(tuple(parts), (3.0, 3.4, 1.4), (), tuple(area))


def _props(rng: np.random.Generator) -> list[Surface]:
    """Return what a cove is painted white for: cubes, drums, a chair, a plant, coloured sheets."""
    parts: list[Surface] = []
    for number in range(9):
        angle = 2.0 * math.pi * (number + float(rng.uniform(0.0, 0.6))) / 9.0
        far = float(rng.uniform(1.7, 2.4))
        at = (3.0 + far * math.cos(angle), 3.4 + far * math.sin(angle), 0.0)
        paint = Finish(Pattern.PLAIN, vivid(rng, 0.05, 0.7), roughness=0.5)
        tall = float(rng.uniform(0.5, 1.7))
        if number % 3 == 0:
            thing = [
                lathe(paint, (0, 0, 0), [(0.01, 0.0), (0.22, 0.0), (0.22, tall), (0.01, tall)])
            ]
        elif number % 3 == 1:
            thing = [box(paint, (-0.45, -0.015, 0.0), (0.45, 0.015, 1.2 + 0.5 * tall))]
        else:
            thing = f.chair(r.OAK, paint)
        parts += [moved(part, at, angle + math.pi / 2.0) for part in thing]
    return parts


def _card(x: float, y: float, turn_deg: float) -> list[Surface]:
    """Return a board of grey and coloured patches on a stand."""
    parts = [
        rod(r.BLACK, (0, 0, 0), 1.1, (0.015, 0.015), 8),
        box(r.BLACK, (-0.33, -0.02, 1.1), (0.33, 0.0, 1.56)),
    ]
    values = [0.03, 0.09, 0.19, 0.36, 0.59, 0.85]
    hues: list[Rgb] = [
        (0.4, 0.05, 0.04),
        (0.08, 0.3, 0.07),
        (0.04, 0.08, 0.35),
        (0.6, 0.45, 0.03),
        (0.5, 0.1, 0.3),
        (0.03, 0.3, 0.4),
    ]
    for number in range(6):
        u = -0.3 + 0.1 * number
        for row, rgb in enumerate((hues[number], (values[number],) * 3)):
            patch = Finish(Pattern.PLAIN, (rgb[0], rgb[1], rgb[2]), roughness=0.9)
            z = 1.14 + 0.2 * row
            parts.append(box(patch, (u + 0.008, 0.0, z), (u + 0.092, 0.005, z + 0.17)))
    return [moved(part, (x, y, 0.0), math.radians(turn_deg)) for part in parts]


def _roll(rgb: Rgb, x: float, middle_y: float) -> list[Surface]:
    """Return a paper backdrop that hangs at x and sweeps out over the floor towards -x."""
    paper = Finish(Pattern.MOTTLED, r.times(rgb, 0.94), rgb, 2.5, 0.9)
    profile = [(-2.6, 0.012), (-1.0, 0.014)]
    profile += [
        (-1.0 + 0.9 * math.sin(a), 0.914 - 0.9 * math.cos(a))
        for a in np.linspace(0.1, math.pi / 2, 12)
    ]
    profile += [(-0.1, 2.75)]
    rows = [[(x + dx, middle_y + s * 1.45, z) for s in (1.0, -1.0)] for dx, z in profile]
    vertices = np.array(rows).reshape(-1, 3)
    quads = grid_quads(len(profile), 2)
    sweep = Surface(paper, vertices, quads, np.zeros((len(quads), 4, 2)), smooth=True)
    bar = box(r.STEEL, (x - 0.16, middle_y - 1.7, 2.74), (x - 0.06, middle_y + 1.7, 2.84))
    posts = [
        rod(r.BLACK, (x - 0.1, middle_y + s * 1.68, 0.0), 2.8, (0.02, 0.02), 8) for s in (-1.0, 1.0)
    ]
    return [sweep, bar, *posts]


def _coved(rgb: Rgb, x: float, y: float) -> list[Surface]:
    """Return quarter rounds where the walls meet the floor."""
    finish = Finish(Pattern.MOTTLED, r.times(rgb, 0.97), rgb, 2.0, 0.8)
    radius = 0.9
    angles = np.linspace(0.0, math.pi / 2.0, 14)
    out, up = radius - radius * np.sin(angles), radius - radius * np.cos(angles)
    parts = []
    for wall in range(4):
        rows = []
        for d, z in zip(out, up, strict=True):
            low, high = (d, d), (x - d, y - d)
            ends = [
                ((low[0], low[1]), (high[0], low[1])),
                ((high[0], low[1]), (high[0], high[1])),
                ((high[0], high[1]), (low[0], high[1])),
                ((low[0], high[1]), (low[0], low[1])),
            ][wall]
            rows.append([(*ends[0], z), (*ends[1], z)])
        quads = grid_quads(len(angles), 2)
        vertices = np.array(rows).reshape(-1, 3)
        parts.append(Surface(finish, vertices, quads, np.zeros((len(quads), 4, 2)), smooth=True))
    return parts


def _gear(rng: np.random.Generator, x: float, y: float) -> list[Surface]:
    """Return what stands about in a studio: cases, a table, a chair, a reflector, a tripod."""
    parts = [moved(p, (0.6, y - 0.7, 0.0), 0.3) for p in f.crates(rng, 6)]
    parts += [
        moved(p, (0.45, y * 0.4, 0.0), math.radians(-90.0)) for p in f.table(r.PINE, 1.6, 0.6)
    ]
    parts += [moved(p, (1.3, 0.8, 0.0), 0.6) for p in f.chair(r.BLACK, f.cloth((0.1, 0.1, 0.11)))]
    silver = Finish(Pattern.PLAIN, (0.7, 0.7, 0.7), roughness=0.5, metallic=0.6)
    parts.append(
        moved(box(silver, (-0.5, -0.01, 0.1), (0.5, 0.01, 1.9)), (x * 0.25, 0.3, 0.0), 0.1)
    )
    for step in range(3):
        angle = step * 2.0 * math.pi / 3.0
        parts.append(
            moved(
                box(r.BLACK, (0.0, -0.012, 0.0), (0.45, 0.012, 0.03)),
                (x * 0.2, y * 0.8, 0.0),
                angle,
            )
        )
    parts.append(rod(r.BLACK, (x * 0.2, y * 0.8, 0.0), 1.5, (0.02, 0.02), 8))
    parts.append(
        box(r.BLACK, (x * 0.2 - 0.1, y * 0.8 - 0.08, 1.5), (x * 0.2 + 0.1, y * 0.8 + 0.08, 1.65))
    )
    return parts


_Lit = tuple[list[AreaLamp], list[Surface], list[PointLamp]]
_FLASH: Rgb = (1.0, 0.97, 0.93)


def softbox(
    at_m: Point, aim_m: Point, width_m: float, height_m: float, radiance: Rgb
) -> tuple[list[AreaLamp], list[Surface]]:
    """Return a softbox on its stand, turned to `aim_m` (its tilt is drawn upright)."""
    way = np.array(aim_m) - np.array(at_m)
    turn = math.atan2(way[1], way[0])
    w, h = width_m / 2.0, height_m / 2.0
    face = box(r.glow(radiance), (0.0, -w, -h), (0.01, w, h))
    back = box(r.BLACK, (-0.3, -w * 0.55, -h * 0.55), (-0.02, w * 0.55, h * 0.55))
    rim = box(r.BLACK, (-0.04, -w - 0.03, -h - 0.03), (0.0, w + 0.03, h + 0.03))
    stand = rod(r.BLACK, (-0.2, 0.0, -at_m[2]), at_m[2], (0.018, 0.018), 8)
    parts = [moved(part, at_m, turn) for part in (face, back, rim, stand)]
    length = float(np.linalg.norm(way))
    towards = (float(way[0]) / length, float(way[1]) / length, float(way[2]) / length)
    ahead = (at_m[0] + 0.03 * math.cos(turn), at_m[1] + 0.03 * math.sin(turn), at_m[2])
    return [AreaLamp(ahead, towards, width_m, height_m, radiance, 125.0)], parts


def _joined(*lit: tuple[list[AreaLamp], list[Surface]]) -> _Lit:
    return (
        [lamp for lamps, _ in lit for lamp in lamps],
        [part for _, parts in lit for part in parts],
        [],
    )


def _two_softboxes(x: float, y: float, side: float) -> _Lit:
    aim = (x * 0.5, y / 2.0, 1.2)
    first = softbox((x * 0.24, y / 2.0 + 1.9 * side, 1.9), aim, 0.9, 1.2, r.times(_FLASH, 26.0))
    second = softbox((x * 0.34, y / 2.0 - 2.2 * side, 1.7), aim, 0.9, 1.2, r.times(_FLASH, 13.0))
    return _joined(first, second)


def _one_softbox(x: float, y: float, side: float) -> _Lit:
    at = (x * 0.30, y / 2.0 + 2.2 * side, 1.8)
    return _joined(softbox(at, (x * 0.5, y / 2.0, 1.3), 1.3, 1.6, r.times(_FLASH, 22.0)))


def _umbrella(x: float, y: float, side: float) -> _Lit:
    at = (x * 0.24, y / 2.0 + 1.2 * side, 2.35)
    dome = lathe(
        r.glow(r.times(_FLASH, 16.0)), at, [(0.75, -0.1), (0.6, 0.1), (0.3, 0.25), (0.02, 0.3)]
    )
    towards = (0.8, -0.45 * side, -0.75)
    lamp = AreaLamp((at[0], at[1], at[2] - 0.15), towards, 1.3, 1.3, r.times(_FLASH, 16.0))
    stand = rod(r.BLACK, (at[0] - 0.6, at[1], 0.0), 2.5, (0.018, 0.018), 8)
    return [lamp], [dome, stand], []


def _ring(x: float, y: float, _side: float) -> _Lit:
    at = (x * 0.42 - 1.5, y / 2.0, 1.45)
    tube = [
        (0.26 + 0.04 * math.cos(a), 0.04 * math.sin(a)) for a in np.linspace(0.0, 2 * math.pi, 9)
    ]
    flat = lathe(r.glow(r.times(_FLASH, 60.0)), (0, 0, 0), tube)
    upright = flat.vertices_m[:, [2, 0, 1]] + np.array(at)
    ring = Surface(flat.finish, upright, flat.quads, flat.uvs_m, smooth=True)
    lamp = AreaLamp((at[0] + 0.06, at[1], at[2]), (1.0, 0.0, 0.0), 0.5, 0.5, r.times(_FLASH, 34.0))
    return [lamp], [ring, rod(r.BLACK, (at[0] - 0.05, at[1], 0.0), 1.18, (0.018, 0.018), 8)], []


def _rims(x: float, y: float, side: float) -> _Lit:
    aim = (x * 0.42, y / 2.0, 1.3)
    strips = [
        softbox(
            (x * 0.75, y / 2.0 + s * 1.9, 1.6),
            aim,
            0.3,
            1.5,
            r.times(_FLASH, 40.0 if s == side else 22.0),
        )
        for s in (-1.0, 1.0)
    ]
    fill = softbox((0.5, y / 2.0, 2.0), aim, 1.0, 1.0, r.times(_FLASH, 2.5))
    return _joined(*strips, fill)


def _gels(x: float, y: float, side: float) -> _Lit:
    aim = (x * 0.45, y / 2.0, 1.3)
    pairs: list[tuple[Rgb, Rgb]] = [
        ((1.0, 0.25, 0.5), (0.2, 0.45, 1.0)),
        ((1.0, 0.5, 0.1), (0.1, 0.75, 0.8)),
    ]
    pair = pairs[0 if side > 0 else 1]
    first = softbox((x * 0.28, y / 2.0 + 2.1, 1.8), aim, 0.9, 1.2, r.times(pair[0], 24.0))
    second = softbox((x * 0.28, y / 2.0 - 2.1, 1.7), aim, 0.9, 1.2, r.times(pair[1], 24.0))
    fill = softbox((0.5, y / 2.0, 2.2), aim, 1.2, 1.2, r.times(_FLASH, 6.0))
    return _joined(first, second, fill)


def _spot(x: float, y: float, side: float) -> _Lit:
    aim = (x * 0.55, y / 2.0, 1.0)
    key = softbox((x * 0.22, y / 2.0 + 1.8 * side, 2.4), aim, 0.3, 0.3, r.times(_FLASH, 240.0))
    fill = softbox((0.6, y / 2.0 - 1.5 * side, 2.0), aim, 1.2, 1.2, r.times(_FLASH, 3.0))
    return _joined(key, fill)


def _table(x: float, y: float, side: float) -> _Lit:
    middle = (x * 0.42 + 1.3, y / 2.0, 0.0)
    top = [moved(part, middle) for part in f.table(r.WHITE, 1.0, 1.4, 0.8)]
    aim = (middle[0], middle[1], 1.1)
    panels = [
        softbox(
            (middle[0] + 0.1, y / 2.0 + s * 1.5, 1.3),
            aim,
            0.7,
            0.7,
            r.times(_FLASH, 30.0 if s == side else 18.0),
        )
        for s in (-1.0, 1.0)
    ]
    lamps, parts, points = _joined(*panels)
    return lamps, [*parts, *top], points


_LIGHTS = {
    "two_softboxes": _two_softboxes,
    "one_softbox": _one_softbox,
    "umbrella": _umbrella,
    "ring": _ring,
    "rims": _rims,
    "gels": _gels,
    "spot": _spot,
    "table": _table,
}
