"""What people put outdoors: houses, fences, lamps, benches, cars."""

import math

import numpy as np

from services.worker.places.place import Finish, Pattern, Rgb, Surface, rgb_of
from services.worker.places.shapes import ball, box, boxes, lathe, moved, rod

_WALLS: tuple[Rgb, ...] = (
    (0.42, 0.36, 0.28),
    (0.30, 0.14, 0.10),
    (0.50, 0.48, 0.44),
    (0.24, 0.24, 0.25),
    (0.46, 0.33, 0.20),
    (0.36, 0.38, 0.38),
    (0.52, 0.42, 0.33),
    (0.18, 0.12, 0.09),
)
_ROOFS: tuple[Rgb, ...] = ((0.16, 0.06, 0.04), (0.06, 0.06, 0.065), (0.12, 0.10, 0.085))
_GLASS = (0.035, 0.045, 0.055)
_IRON = Finish(Pattern.PLAIN, (0.03, 0.033, 0.035), roughness=0.5)
_WOOD = Finish(Pattern.PLANKS, (0.20, 0.12, 0.065), (0.27, 0.17, 0.10), 0.12, 0.7)
_CAR_GLASS = Finish(Pattern.PLAIN, (0.01, 0.012, 0.014), roughness=0.08)
_TYRE = Finish(Pattern.PLAIN, (0.015, 0.015, 0.015), roughness=0.9)
_CARS: tuple[Rgb, ...] = (
    (0.32, 0.02, 0.02),
    (0.03, 0.06, 0.18),
    (0.55, 0.55, 0.54),
    (0.02, 0.02, 0.022),
    (0.22, 0.23, 0.24),
    (0.10, 0.16, 0.12),
    (0.45, 0.40, 0.30),
)


def buildings_around(
    rng: np.random.Generator,
    nearest_m: float,
    farthest_m: float,
    heights_m: tuple[float, float],
    *,
    rows: bool = False,
    count: int = 34,
    towards_deg: float | None = None,
    down_m: float = 0.0,
) -> list[Surface]:
    """Return houses: in two rows along a street, one in a direction, or all around."""
    if rows:
        return _rows(rng, nearest_m, heights_m)
    found: list[Surface] = []
    for number in range(count):
        angle = 2.0 * math.pi * (number + rng.uniform(-0.3, 0.3)) / count
        if count > 60:  # a town: anywhere
            angle = rng.uniform(0.0, 2.0 * math.pi)
        if towards_deg is not None:
            angle = math.radians(towards_deg)
        wide = float(rng.uniform(9.0, 17.0)) if towards_deg is None else 13.0
        deep = float(rng.uniform(8.0, 13.0))
        tall = float(rng.uniform(*heights_m))
        away = math.sqrt(rng.uniform(nearest_m**2, farthest_m**2)) + deep / 2.0
        at = (away * math.cos(angle), away * math.sin(angle), -down_m)
        turn = angle + math.pi / 2.0 if count <= 60 else math.pi / 8.0 * float(rng.integers(0, 4))
        found += [moved(s, at, turn) for s in _house(rng, wide, deep, tall)]
    return found


def _rows(
    rng: np.random.Generator, from_axis_m: float, heights_m: tuple[float, float]
) -> list[Surface]:
    found: list[Surface] = []
    for side in (-1.0, 1.0):
        x = -150.0
        while x < 150.0:
            wide, deep = float(rng.uniform(9.0, 19.0)), float(rng.uniform(9.0, 12.0))
            tall = float(rng.uniform(*heights_m))
            gap = float(rng.choice([0.0, 0.0, 3.0]))
            at = (x + wide / 2.0, side * (from_axis_m + deep / 2.0 + rng.uniform(0.0, 0.5)), 0.0)
            found += [moved(s, at) for s in _house(rng, wide, deep, tall)]
            x += wide + gap
    return found


def _house(rng: np.random.Generator, wide: float, deep: float, tall: float) -> list[Surface]:
    wall = _WALLS[int(rng.integers(0, len(_WALLS)))]
    wall_rgb = rgb_of(v * rng.uniform(0.8, 1.2) for v in wall)
    storey = float(rng.uniform(2.7, 3.4))
    tall = max(round(tall / storey), 1) * storey
    walls = Finish(Pattern.WINDOWS, _GLASS, wall_rgb, storey, 0.9)
    plain = Finish(Pattern.MOTTLED, rgb_of(0.8 * v for v in wall_rgb), wall_rgb, 0.8, 0.9)
    x, y = wide / 2.0, deep / 2.0
    body = box(walls, (-x, -y, 0.0), (x, y, tall))
    base = box(plain, (-x - 0.06, -y - 0.06, 0.0), (x + 0.06, y + 0.06, 0.7))
    cornice = box(plain, (-x - 0.25, -y - 0.25, tall), (x + 0.25, y + 0.25, tall + 0.35))
    parts = [body, base, cornice]
    door = Finish(Pattern.PLAIN, (0.06, 0.04, 0.03), roughness=0.5)
    parts.append(
        boxes(door, [((-0.6, s * y - 0.1, 0.0), (0.6, s * y + 0.1, 2.2)) for s in (-1, 1)])
    )
    if tall < 20.0 and rng.random() < 0.7:
        tiles = Finish(Pattern.TILES, _ROOFS[int(rng.integers(0, 3))], (0.02, 0.02, 0.02), 0.3, 0.9)
        parts.append(_gable(tiles, x + 0.4, y + 0.4, tall + 0.3, 0.45 * deep))
    else:
        parts.append(box(plain, (-x * 0.4, -y * 0.4, tall), (-x * 0.1, y * 0.2, tall + 2.2)))
    return parts


def _gable(finish: Finish, x: float, y: float, z: float, rise: float) -> Surface:
    vertices = np.array(
        [[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z], [-x, 0, z + rise], [x, 0, z + rise]]
    )
    quads = np.array([[0, 1, 5, 4], [2, 3, 4, 5], [3, 0, 4, 4], [1, 2, 5, 5]], dtype=np.int32)
    slope = math.hypot(y, rise)
    uvs = np.array([[[0, 0], [2 * x, 0], [2 * x, slope], [0, slope]]] * 4)
    return Surface(finish, vertices, quads, uvs)


def fence(rng: np.random.Generator, half_m: float, *, solid: bool = False) -> list[Surface]:
    """Return a board fence, or a parapet with a rail, in a square around the eye."""
    tall = float(rng.uniform(1.5, 1.8)) if not solid else 0.9
    thick = 0.03 if not solid else 0.2
    boards = []
    for side in (-1.0, 1.0):
        if solid:
            boards += [
                ((-half_m, side * half_m, 0.0), (half_m, side * half_m + thick, tall)),
                ((side * half_m, -half_m, 0.0), (side * half_m + thick, half_m, tall)),
            ]
            continue
        for x in np.arange(-half_m, half_m, 0.16):
            high = tall + float(rng.uniform(-0.01, 0.01))
            boards += [
                ((x, side * half_m, 0.05), (x + 0.14, side * half_m + thick, high)),
                ((side * half_m, x, 0.05), (side * half_m + thick, x + 0.14, high)),
            ]
    wall = Finish(Pattern.MOTTLED, (0.32, 0.30, 0.28), (0.42, 0.40, 0.37), 0.8, 0.9)
    lows = [(min(a[0], b[0]), min(a[1], b[1]), a[2]) for a, b in boards]
    highs = [(max(a[0], b[0]), max(a[1], b[1]), b[2]) for a, b in boards]
    return [boxes(wall if solid else _WOOD, list(zip(lows, highs, strict=True)))]


def street_furniture(
    rng: np.random.Generator, from_axis_m: float, *, rows: bool = False
) -> list[Surface]:
    """Return lamp posts, benches and bins; in two rows along x, or in a ring."""
    found: list[Surface] = []
    for number in range(8):
        if rows:
            at = ((number // 2 - 1.5) * 17.0 + 4.0, (number % 2 * 2 - 1) * from_axis_m, 0.14)
            turn = math.pi if number % 2 else 0.0
        else:
            turn = 2.0 * math.pi * (number + rng.uniform(-0.2, 0.2)) / 8.0
            away = from_axis_m * float(rng.uniform(0.8, 1.6))
            at = (away * math.cos(turn), away * math.sin(turn), 0.0)
            turn += math.pi / 2.0
        kind = (lamp_post, bench, lamp_post, bin_)[number % 4]
        found += [moved(s, at, turn) for s in kind()]
    return found


def lamp_post() -> list[Surface]:
    """Return a lamp post of five metres."""
    glass = Finish(Pattern.PLAIN, (0.7, 0.7, 0.66), roughness=0.3)
    post = lathe(_IRON, (0, 0, 0), [(0.14, 0), (0.12, 0.7), (0.06, 0.9), (0.045, 4.6), (0.2, 4.7)])
    return [post, lathe(glass, (0, 0, 4.7), [(0.2, 0), (0.26, 0.2), (0.2, 0.45), (0.05, 0.55)])]


def bench() -> list[Surface]:
    """Return a bench of three slats and a back."""
    slats = [((-0.9, y, 0.42), (0.9, y + 0.13, 0.46)) for y in (-0.2, -0.04, 0.12)]
    backs = [((-0.9, 0.3, z), (0.9, 0.33, z + 0.13)) for z in (0.55, 0.74)]
    legs = [((x, -0.2, 0.0), (x + 0.06, 0.33, 0.42)) for x in (-0.8, 0.74)]
    stays = [((x, 0.28, 0.4), (x + 0.06, 0.31, 0.88)) for x in (-0.8, 0.74)]
    return [boxes(_WOOD, [*slats, *backs]), boxes(_IRON, [*legs, *stays])]


def bin_() -> list[Surface]:
    """Return a litter bin."""
    return [lathe(_IRON, (0, 0, 0), [(0.22, 0), (0.26, 0.8), (0.27, 0.85), (0.1, 0.86)])]


def people_sized_things(rng: np.random.Generator) -> list[Surface]:
    """Return planters, a table and chairs near the eye."""
    pot = Finish(Pattern.MOTTLED, (0.35, 0.17, 0.10), (0.42, 0.23, 0.15), 0.2, 0.9)
    found: list[Surface] = []
    for _ in range(5):
        angle, away = rng.uniform(0, 2 * math.pi), rng.uniform(2.8, 6.0)
        at = (away * math.cos(angle), away * math.sin(angle), 0.0)
        found.append(
            lathe(pot, at, [(0.2, 0), (0.3, 0.45), (0.33, 0.5), (0.28, 0.5), (0.05, 0.46)])
        )
    turn = float(rng.uniform(0.0, 2.0 * math.pi))
    at = (3.4 * math.cos(turn), 3.4 * math.sin(turn), 0.0)
    table = [
        box(_WOOD, (-0.6, -0.4, 0.70), (0.6, 0.4, 0.74)),
        rod(_IRON, (0, 0, 0), 0.7, (0.05, 0.05)),
    ]
    for side in (-1.0, 1.0):
        table.append(box(_WOOD, (-0.22, side * 0.8 - 0.22, 0.42), (0.22, side * 0.8 + 0.22, 0.46)))
        table.append(box(_IRON, (-0.2, side * 1.0 - 0.02, 0.0), (0.2, side * 1.0 + 0.02, 0.85)))
    return [*found, *(moved(part, at, turn) for part in table)]


def parked_cars(rng: np.random.Generator, y_m: float, *, turned: bool = False) -> list[Surface]:
    """Return cars along x (or side by side in bays), with gaps."""
    found: list[Surface] = []
    pitch = 2.6 if turned else 6.1
    for x in np.arange(-32.0, 32.0, pitch):
        if abs(x) < 4.0 or rng.random() < 0.45:
            continue
        paint = _CARS[int(rng.integers(0, len(_CARS)))]
        sides = (y_m,) if turned else (y_m, -y_m)
        for y in sides:
            if not turned and rng.random() < 0.35:
                continue
            turn = math.pi / 2.0 if turned else 0.0
            found += [moved(part, (float(x) + 1.3, y, 0.0), turn) for part in _car(paint)]
    return found


def _car(paint: Rgb) -> list[Surface]:
    body = Finish(Pattern.PLAIN, paint, roughness=0.22)
    profile = [
        (-2.1, 0.35),
        (-2.15, 0.75),
        (-1.9, 0.92),
        (-1.55, 1.0),
        (-0.95, 1.42),
        (0.55, 1.45),
        (1.15, 1.0),
        (1.95, 0.86),
        (2.15, 0.62),
        (2.1, 0.32),
    ]
    hull = _extruded(body, profile, 0.84)
    glass = _extruded(_CAR_GLASS, [(-1.5, 1.01), (-0.92, 1.37), (0.5, 1.40), (1.04, 1.01)], 0.855)
    tyres = [_wheel(x, y) for x in (-1.3, 1.3) for y in (-0.8, 0.8)]
    return [hull, glass, *tyres]


def _wheel(x: float, y: float) -> Surface:
    upright = ball(_TYRE, (0.0, 0.0, 0.0), 0.32, 1.0)
    flat = upright.vertices_m * np.array([1.0, 0.32, 1.0]) + np.array([x, y, 0.32])
    return Surface(_TYRE, flat, upright.quads, upright.uvs_m, smooth=True)


def _extruded(finish: Finish, profile: list[tuple[float, float]], half_m: float) -> Surface:
    """Return a body with an (x, z) outline, narrower at its top, from -half_m to half_m in y."""
    outline = np.array(profile)
    tuck = np.where(outline[:, 1] > 1.05, 0.86, 1.0) * half_m
    left = np.stack([outline[:, 0], -tuck, outline[:, 1]], axis=-1)
    right = left * np.array([1.0, -1.0, 1.0])
    count = len(outline)
    near = np.arange(count)
    far = (near + 1) % count
    hull = np.stack([near, far, far + count, near + count], axis=-1)
    fans = [[0, i, i + 1, i + 1] for i in range(1, count - 1)]
    other = [[count, count + i + 1, count + i, count + i] for i in range(1, count - 1)]
    quads = np.concatenate([hull, np.array(fans), np.array(other)]).astype(np.int32)
    return Surface(finish, np.concatenate([left, right]), quads, np.zeros((len(quads), 4, 2)))
