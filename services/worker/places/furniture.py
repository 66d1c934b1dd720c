"""Furniture, each piece about its own origin on the floor, facing +y, metres."""

import math

import numpy as np

from services.worker.places.place import Finish, Pattern, Rgb, Surface, muted, rgb_of
from services.worker.places.rooms import BLACK, MARBLE, OAK, STEEL
from services.worker.places.shapes import ball, box, boxes, grid_quads, lathe, moved, rod

Parts = list[Surface]


def cloth(rgb: Rgb) -> Finish:
    """Return a woven cloth of a colour."""
    return Finish(Pattern.MOTTLED, rgb_of(0.8 * v for v in rgb), rgb, 0.02, 1.0)


def table(finish: Finish, length_m: float, width_m: float, height_m: float = 0.74) -> Parts:
    """Return a table with four legs."""
    x, y = length_m / 2.0, width_m / 2.0
    legs = [
        ((a - 0.03, b - 0.03, 0.0), (a + 0.03, b + 0.03, height_m - 0.03))
        for a in (-x + 0.07, x - 0.07)
        for b in (-y + 0.07, y - 0.07)
    ]
    return [box(finish, (-x, -y, height_m - 0.03), (x, y, height_m)), boxes(finish, legs)]


def chair(finish: Finish, seat: Finish) -> Parts:
    """Return a chair whose sitter looks along +y."""
    legs = [
        ((a - 0.02, b - 0.02, 0.0), (a + 0.02, b + 0.02, 0.43))
        for a in (-0.19, 0.19)
        for b in (-0.19, 0.19)
    ]
    posts = [((a - 0.02, -0.21, 0.43), (a + 0.02, -0.17, 0.88)) for a in (-0.19, 0.19)]
    slats = [((-0.19, -0.2, z), (0.19, -0.18, z + 0.09)) for z in (0.58, 0.76)]
    return [
        boxes(finish, [*legs, *posts, *slats]),
        box(seat, (-0.22, -0.22, 0.43), (0.22, 0.22, 0.48)),
    ]


def stool(finish: Finish, seat: Finish) -> Parts:
    """Return a stool with a cushion."""
    legs = [
        ((a - 0.02, b - 0.02, 0.0), (a + 0.02, b + 0.02, 0.44))
        for a in (-0.15, 0.15)
        for b in (-0.15, 0.15)
    ]
    return [boxes(finish, legs), _cushion(seat, (0.0, 0.0, 0.48), (0.4, 0.4, 0.1))]


def office_chair(seat: Finish) -> Parts:
    """Return a swivel chair."""
    base = [rod(BLACK, (0, 0, 0.06), 0.38, (0.03, 0.03), 8)]
    for step in range(5):
        angle = step * 2.0 * math.pi / 5.0
        base.append(moved(box(BLACK, (0.0, -0.025, 0.05), (0.3, 0.025, 0.09)), (0, 0, 0), angle))
    base.append(_cushion(seat, (0.0, 0.0, 0.48), (0.5, 0.48, 0.09)))
    base.append(_cushion(seat, (0.0, -0.24, 0.85), (0.45, 0.08, 0.55)))
    return base


def sofa(finish: Finish, seats: int, rng: np.random.Generator) -> Parts:
    """Return a sofa with cushions; its sitters look along +y."""
    wide = 0.75 * seats
    x = wide / 2.0
    parts = [
        _cushion(finish, (0.0, -0.35, 0.42), (wide + 0.3, 0.24, 0.84)),
        _cushion(finish, (-x - 0.1, 0.05, 0.31), (0.2, 0.86, 0.60)),
        _cushion(finish, (x + 0.1, 0.05, 0.31), (0.2, 0.86, 0.60)),
        box(finish, (-x, -0.4, 0.06), (x, 0.42, 0.3)),
    ]
    for seat in range(seats):
        at = -x + 0.375 + 0.75 * seat
        parts.append(_cushion(finish, (at, 0.06, 0.37), (0.74, 0.76, 0.17)))
        if rng.random() < 0.6:
            colour = cloth(muted(rng, 0.05, 0.6))
            parts.append(_cushion(colour, (at, -0.14, 0.62), (0.42, 0.16, 0.40)))
    return parts


def bed(finish: Finish, cover: Finish, rng: np.random.Generator) -> Parts:
    """Return a double bed whose head is at -y."""
    pillow = cloth((0.68, 0.67, 0.64))
    head = box(finish, (-0.85, -1.06, 0.0), (0.85, -1.0, 1.0))
    frame = box(finish, (-0.83, -1.0, 0.1), (0.83, 1.03, 0.32))
    sheet = _cushion(pillow, (0.0, 0.0, 0.42), (1.62, 2.02, 0.24))
    quilt = _cushion(cover, (0.0, 0.28, 0.47), (1.7, 1.45, 0.24))
    pillows = [
        _cushion(pillow, (s * 0.4, -0.75, 0.6 + 0.02 * rng.random()), (0.66, 0.42, 0.2))
        for s in (-1, 1)
    ]
    return [head, frame, sheet, quilt, *pillows]


def shelf(
    finish: Finish, width_m: float, height_m: float, rng: np.random.Generator, *, full: float = 0.85
) -> Parts:
    """Return a shelf against a wall behind -y, filled with books and a few things."""
    x, deep, rows = width_m / 2.0, 0.3, max(round(height_m / 0.36), 1)
    step = height_m / rows
    boards = [((-x, -deep, r * step), (x, 0.0, r * step + 0.022)) for r in range(rows + 1)]
    sides = [((s * x - 0.012, -deep, 0.0), (s * x + 0.012, 0.0, height_m)) for s in (-1.0, 1.0)]
    back = box(finish, (-x, -deep - 0.01, 0.0), (x, -deep, height_m))
    parts = [boxes(finish, [*boards, *sides]), back]
    for row in range(rows):
        parts += _books(rng, -x + 0.03, x - 0.03, row * step + 0.022, step - 0.05, full)
    return parts


def _books(
    rng: np.random.Generator, low: float, high: float, z: float, tall: float, full: float
) -> Parts:
    # A handful of colours a row: fewer materials, and shelves are like that.
    colours = [muted(rng, 0.02, 0.5) for _ in range(5)]
    kinds = [Finish(Pattern.PLAIN, colour, roughness=0.6) for colour in colours]
    groups: list[list[tuple[tuple[float, float, float], tuple[float, float, float]]]] = [
        [] for _ in kinds
    ]
    things: Parts = []
    x = low
    while x < high - 0.06:
        if rng.random() > full:
            if rng.random() < 0.35 and high - x > 0.3:
                vase = Finish(Pattern.PLAIN, colours[0], roughness=0.2)
                things.append(
                    lathe(
                        vase,
                        (x + 0.12, -0.15, z),
                        [(0.05, 0), (0.09, 0.08), (0.04, 0.17), (0.05, 0.2)],
                    )
                )
            x += float(rng.uniform(0.1, 0.35))
            continue
        thick = float(rng.uniform(0.014, 0.05))
        height, deep = tall * float(rng.uniform(0.62, 0.97)), float(rng.uniform(0.15, 0.23))
        groups[int(rng.integers(0, len(kinds)))].append(
            ((x, -deep - 0.05, z), (x + thick, -0.05, z + height))
        )
        x += thick + 0.001
    return [
        *things,
        *(boxes(kind, group) for kind, group in zip(kinds, groups, strict=True) if group),
    ]


def kitchen(finish: Finish, length_m: float, rng: np.random.Generator) -> Parts:
    """Return a kitchen line against a wall behind -y: cupboards, worktop, sink, hob, hood."""
    x = length_m / 2.0
    units = round(length_m / 0.6)
    lower, upper, grips = [], [], []
    for unit in range(units):
        a = -x + unit * length_m / units
        b = a + length_m / units
        lower.append(((a + 0.003, -0.6, 0.1), (b - 0.003, 0.0, 0.86)))
        grips.append(((a + 0.1, 0.0, 0.78), (b - 0.1, 0.02, 0.795)))
        if unit != units // 2:
            upper.append(((a + 0.003, -0.6, 1.42), (b - 0.003, -0.26, 2.1)))
            grips.append(((a + 0.1, -0.26, 1.46), (b - 0.1, -0.24, 1.475)))
    top = MARBLE if rng.random() < 0.5 else OAK
    hood = boxes(
        STEEL, [((-0.3, -0.6, 1.6), (0.3, -0.15, 1.68)), ((-0.13, -0.6, 1.68), (0.13, -0.34, 2.5))]
    )
    tiles = Finish(Pattern.TILES, (0.55, 0.56, 0.55), (0.35, 0.35, 0.34), 0.1, 0.25)
    splash = box(tiles, (-x, -0.605, 0.9), (x, -0.595, 1.42))
    parts = [
        boxes(finish, lower + upper),
        boxes(STEEL, grips),
        box(top, (-x, -0.6, 0.86), (x, 0.02, 0.9)),
        hood,
        splash,
    ]
    parts.append(box(BLACK, (-0.29, -0.52, 0.9), (0.29, -0.06, 0.906)))
    parts.append(box(BLACK, (-x, -0.55, 0.0), (x, -0.05, 0.1)))
    for _ in range(7):
        colour = Finish(Pattern.PLAIN, muted(rng, 0.03, 0.7), roughness=0.3)
        at = (float(rng.uniform(-x + 0.2, x - 0.2)), float(rng.uniform(-0.5, -0.3)), 0.9)
        tall = float(rng.uniform(0.08, 0.26))
        parts.append(lathe(colour, at, [(0.045, 0), (0.055, tall * 0.6), (0.03, tall)]))
    return parts


def desk(finish: Finish, rng: np.random.Generator, *, screen: Rgb = (0.25, 0.32, 0.45)) -> Parts:
    """Return a desk with a monitor, keyboard, papers and a mug; the user sits at -y."""
    glow = Finish(Pattern.GLOW, screen)
    parts = table(finish, 1.5, 0.75)
    parts += [
        box(BLACK, (-0.3, 0.2, 0.92), (0.3, 0.23, 1.28)),
        box(glow, (-0.285, 0.196, 0.935), (0.285, 0.199, 1.265)),
        box(BLACK, (-0.03, 0.21, 0.74), (0.03, 0.24, 0.95)),
        box(BLACK, (-0.12, 0.15, 0.74), (0.12, 0.3, 0.75)),
        box(BLACK, (-0.22, -0.18, 0.74), (0.22, -0.04, 0.76)),
    ]
    paper = Finish(Pattern.PLAIN, (0.7, 0.7, 0.68), roughness=0.8)
    for _ in range(3):
        at = (float(rng.uniform(-0.65, 0.4)), float(rng.uniform(-0.2, 0.15)), 0.741)
        parts.append(
            moved(box(paper, (0, 0, 0), (0.21, 0.297, 0.004)), at, float(rng.uniform(-0.4, 0.4)))
        )
    mug = Finish(Pattern.PLAIN, muted(rng, 0.05, 0.6), roughness=0.2)
    return [
        *parts,
        lathe(mug, (0.45, -0.05, 0.74), [(0.04, 0), (0.042, 0.09), (0.036, 0.09), (0.03, 0.02)]),
    ]


def wardrobe(finish: Finish, width_m: float, height_m: float = 2.1) -> Parts:
    """Return a wardrobe against a wall behind -y."""
    doors = max(round(width_m / 0.5), 1)
    each = width_m / doors
    leaves = [
        (
            (-width_m / 2 + d * each + 0.004, 0.0, 0.08),
            (-width_m / 2 + (d + 1) * each - 0.004, 0.02, height_m - 0.02),
        )
        for d in range(doors)
    ]
    knobs = [ball(STEEL, (low[0] + each - 0.06, 0.04, 1.05), 0.015) for low, _ in leaves]
    return [
        box(finish, (-width_m / 2, -0.55, 0.0), (width_m / 2, 0.0, height_m)),
        boxes(finish, leaves),
        *knobs,
    ]


def bath(rng: np.random.Generator) -> Parts:
    """Return a bath tub, a basin on a cupboard and a towel."""
    glaze = Finish(Pattern.PLAIN, (0.75, 0.75, 0.74), roughness=0.15)
    tub = [
        box(glaze, (-0.85, -0.38, 0.0), (0.85, -0.30, 0.56)),
        box(glaze, (-0.85, 0.30, 0.0), (0.85, 0.38, 0.56)),
        box(glaze, (-0.85, -0.38, 0.0), (-0.77, 0.38, 0.56)),
        box(glaze, (0.77, -0.38, 0.0), (0.85, 0.38, 0.56)),
        box(glaze, (-0.85, -0.38, 0.0), (0.85, 0.38, 0.14)),
    ]
    towel = cloth(muted(rng, 0.1, 0.65))
    return [*tub, box(towel, (-0.3, 0.385, 0.2), (0.1, 0.40, 0.6))]


def rug(rgb: Rgb, length_m: float, width_m: float) -> Parts:
    """Return a rug with a border."""
    x, y = length_m / 2.0, width_m / 2.0
    border = cloth(rgb_of(0.45 * v for v in rgb))
    return [
        box(border, (-x, -y, 0.0), (x, y, 0.012)),
        box(cloth(rgb), (-x + 0.12, -y + 0.12, 0.0), (x - 0.12, y - 0.12, 0.014)),
    ]


def crates(rng: np.random.Generator, count: int) -> Parts:
    """Return boxes of card and plastic in a heap."""
    parts: Parts = []
    for number in range(count):
        card = Finish(Pattern.MOTTLED, (0.33, 0.23, 0.13), (0.40, 0.29, 0.18), 0.3, 0.9)
        plastic = Finish(Pattern.PLAIN, muted(rng, 0.03, 0.4), roughness=0.4)
        size = rng.uniform(0.25, 0.55, 3)
        at = (
            float(rng.uniform(-0.5, 0.5)) * count**0.5 * 0.5,
            float(rng.uniform(-0.2, 0.2)),
            0.0 if number % 3 else 0.42,
        )
        half = size / 2.0
        body = box(
            card if number % 2 else plastic, (-half[0], -half[1], 0.0), (half[0], half[1], size[2])
        )
        parts.append(moved(body, at, float(rng.uniform(-0.5, 0.5))))
    return parts


def _cushion(
    finish: Finish, middle: tuple[float, float, float], size: tuple[float, float, float]
) -> Surface:
    """Return a box with soft edges (a superellipsoid)."""
    rows, sides = 10, 20
    latitude = np.linspace(-math.pi / 2.0, math.pi / 2.0, rows)[:, None]
    angle = (np.arange(sides) * (2.0 * math.pi / sides))[None]
    sharp = 0.35

    def power(
        value: np.ndarray[tuple[int, int], np.dtype[np.float64]],
    ) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        raised: np.ndarray[tuple[int, int], np.dtype[np.float64]] = (
            np.sign(value) * np.abs(value) ** sharp
        )
        return raised

    level = power(np.cos(latitude))
    x, y = level * power(np.cos(angle)), level * power(np.sin(angle))
    z = power(np.sin(latitude)) * np.ones_like(angle)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3) * np.array(size) / 2.0 + np.array(middle)
    quads = grid_quads(rows, sides, closed=True)
    return Surface(finish, vertices, quads, np.zeros((len(quads), 4, 2)), smooth=True)
