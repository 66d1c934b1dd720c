"""Trees, bushes, grass, reeds and boulders, scattered by a seed."""

import math

import numpy as np

from services.worker.places.noise import Fractal
from services.worker.places.place import Array, Copies, Finish, Pattern, Rgb, Surface, rgb_of
from services.worker.places.shapes import ball, leaves, moved, rod

_BARK = Finish(Pattern.MOTTLED, (0.045, 0.032, 0.022), (0.12, 0.09, 0.065), 0.25, 1.0)
_CROWNS: tuple[tuple[Rgb, Rgb], ...] = (
    ((0.035, 0.085, 0.018), (0.10, 0.15, 0.04)),
    ((0.05, 0.10, 0.02), (0.16, 0.17, 0.045)),
    ((0.14, 0.07, 0.015), (0.30, 0.16, 0.03)),
    ((0.016, 0.045, 0.02), (0.04, 0.075, 0.035)),
)
_STONE = Finish(Pattern.PATCHES, (0.11, 0.105, 0.10), (0.27, 0.255, 0.235), 0.7, 1.0)


def scattered(
    rng: np.random.Generator, count: int, nearest_m: float, farthest_m: float
) -> tuple[Array, Array, Array]:
    """Return places (N, 3), turns (N,) and sizes (N,), as many to an area near as far."""
    radius = np.sqrt(rng.uniform(nearest_m**2, farthest_m**2, count))
    angle = rng.uniform(0.0, 2.0 * math.pi, count)
    at = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)], axis=-1)
    return at, rng.uniform(0.0, 2.0 * math.pi, count), rng.uniform(0.7, 1.35, count)


def trees(
    rng: np.random.Generator, count: int, nearest_m: float, farthest_m: float, *, kind: int
) -> list[Copies]:
    """Return trees of a kind (0, 1 broad-leaved, 2 in autumn, 3 firs), three shapes of it."""
    fine = nearest_m < 30.0
    shapes = [_tree(rng, kind % 4, fine=fine) for _ in range(3)]
    return [_shared(rng, shape, count // 3 + 1, nearest_m, farthest_m) for shape in shapes]


def bushes(
    rng: np.random.Generator, count: int, nearest_m: float, farthest_m: float
) -> list[Copies]:
    """Return round bushes of about a metre."""
    dark, light = _CROWNS[int(rng.integers(0, 2))]
    finish = Finish(Pattern.LEAVES, dark, light)
    height = 0.55
    shape = moved(leaves(finish, rng, 1900, (0.8, 0.75, height), 0.05), (0, 0, height * 0.9))
    return [_shared(rng, (shape,), count, nearest_m, farthest_m)]


def grass(
    rng: np.random.Generator, count: int, nearest_m: float, farthest_m: float, *, dry: bool
) -> list[Copies]:
    """Return tufts of grass."""
    colours = (
        ((0.20, 0.16, 0.06), (0.34, 0.27, 0.12))
        if dry
        else ((0.05, 0.11, 0.02), (0.15, 0.17, 0.05))
    )
    shapes = [_tuft(Finish(Pattern.LEAVES, *colours), rng, 130, 0.30, 0.24) for _ in range(3)]
    return [_shared(rng, (shape,), count // 3, nearest_m, farthest_m) for shape in shapes]


def lawn(rng: np.random.Generator, *, dry: bool = False) -> list[Copies]:
    """Return short grass and clover around one's feet: patches of blades a finger long."""
    colours = (
        ((0.22, 0.17, 0.07), (0.36, 0.29, 0.13))
        if dry
        else ((0.04, 0.10, 0.015), (0.14, 0.20, 0.045))
    )
    shapes = [_tuft(Finish(Pattern.LEAVES, *colours), rng, 420, 0.45, 0.07) for _ in range(3)]
    return [_shared(rng, (shape,), 90, 0.3, 6.0) for shape in shapes]


def pebbles(rng: np.random.Generator, farthest_m: float, rgb: Rgb = (0.3, 0.28, 0.25)) -> Copies:
    """Return patches of small stones, a few centimetres each, around one's feet."""
    light = Finish(Pattern.MOTTLED, rgb_of(0.5 * v for v in rgb), rgb, 0.02, 1.0)
    stones = []
    for _ in range(26):
        x, y = rng.normal(0.0, 0.35, 2)
        size = 0.006 + 0.03 * float(rng.random()) ** 3
        stones.append(ball(light, (float(x), float(y), 0.2 * size), size, 0.6))
    return _shared(rng, tuple(stones), 150, 0.3, farthest_m)


def litter(rng: np.random.Generator, farthest_m: float, *, green: bool = False) -> Copies:
    """Return fallen leaves, flat on the ground in patches."""
    colours = (
        ((0.06, 0.09, 0.02), (0.2, 0.2, 0.05)) if green else ((0.13, 0.06, 0.02), (0.36, 0.2, 0.06))
    )
    flat = leaves(Finish(Pattern.LEAVES, *colours), rng, 160, (0.7, 0.7, 0.012), 0.035)
    return _shared(rng, (moved(flat, (0.0, 0.0, 0.02)),), 110, 0.3, farthest_m)


def reeds(
    rng: np.random.Generator, count: int, nearest_m: float, farthest_m: float
) -> list[Copies]:
    """Return tall grass as it stands in shallow water."""
    finish = Finish(Pattern.LEAVES, (0.12, 0.14, 0.04), (0.3, 0.26, 0.12))
    shape = _tuft(finish, rng, 130, 0.5, 1.1)
    return [_shared(rng, (shape,), count, nearest_m, farthest_m)]


def boulders(
    rng: np.random.Generator, count: int, nearest_m: float, farthest_m: float
) -> list[Copies]:
    """Return rocks, most of them small."""
    shapes = [_stone(rng) for _ in range(4)]
    copies = [_shared(rng, (shape,), count // 4, nearest_m, farthest_m) for shape in shapes]
    return [
        Copies(c.surfaces, c.at_m, c.turns_rad, rng.uniform(0.18, 1.0, len(c.sizes)) ** 2.5 * 1.6)
        for c in copies
    ]


def _shared(
    rng: np.random.Generator, shape: tuple[Surface, ...], count: int, near_m: float, far_m: float
) -> Copies:
    return Copies(shape, *scattered(rng, count, near_m, far_m))


def _tree(rng: np.random.Generator, kind: int, *, fine: bool) -> tuple[Surface, ...]:
    finish = Finish(Pattern.LEAVES, *_CROWNS[kind])
    count = 3800 if fine else 900
    leaf_m = 0.19 if fine else 0.46
    height = float(rng.uniform(6.5, 11.0))
    if kind == 3:
        return _fir(rng, finish, height, count, leaf_m)
    trunk = rod(_BARK, (0, 0, -0.4), height * 0.62, (height * 0.026, height * 0.012), 8)
    wide = height * float(rng.uniform(0.28, 0.36))
    crown = leaves(finish, rng, count, (wide, wide, height * 0.33), leaf_m)
    return (trunk, moved(crown, (0.0, 0.0, height * 0.66)))


def _fir(
    rng: np.random.Generator, finish: Finish, height: float, count: int, leaf_m: float
) -> tuple[Surface, ...]:
    trunk = rod(_BARK, (0, 0, -0.4), height, (height * 0.02, 0.02), 8)
    tiers = 9
    crown = []
    for tier in range(tiers):
        t = tier / tiers
        wide = height * 0.2 * (1.0 - t) + 0.12
        part = leaves(
            finish, rng, int(count / tiers * (1.4 - t)), (wide, wide, height * 0.075), leaf_m * 0.8
        )
        crown.append(moved(part, (0.0, 0.0, height * (0.16 + 0.8 * t))))
    return (trunk, *crown)


def _tuft(
    finish: Finish, rng: np.random.Generator, blades: int, wide_m: float, tall_m: float
) -> Surface:
    root = rng.normal(0.0, wide_m / 2.0, (blades, 2))
    lean = rng.normal(0.0, 0.3, (blades, 2)) * tall_m
    tall = tall_m * rng.uniform(0.5, 1.2, blades)
    turn = rng.uniform(0.0, math.pi, blades)
    side = 0.006 * np.stack([np.cos(turn), np.sin(turn)], axis=-1) * (1.0 + tall_m)
    flat = np.zeros((blades, 1))
    feet = [np.concatenate([root + s * side, flat - 0.02], axis=1) for s in (-1.0, 1.0)]
    mids = [
        np.concatenate([root + 0.35 * lean + s * side * 0.8, 0.6 * tall[:, None]], axis=1)
        for s in (1.0, -1.0)
    ]
    tip = np.concatenate([root + lean, tall[:, None]], axis=1)
    vertices = np.stack([*feet, *mids, tip], axis=1).reshape(-1, 3)
    start = 5 * np.arange(blades)[:, None]
    quads = np.concatenate([start + np.array([0, 1, 2, 3]), start + np.array([3, 2, 4, 4])])
    shade = rng.uniform(0.0, 50.0, (blades, 2))
    uvs = np.tile(np.repeat(shade[:, None], 4, axis=1), (2, 1, 1))
    return Surface(finish, vertices, quads.astype(np.int32), uvs)


def _stone(rng: np.random.Generator) -> Surface:
    plain = ball(_STONE, (0.0, 0.0, 0.0), 1.0, 0.7)
    bumps = Fractal(rng, 4, 0.55)
    x, y, z = plain.vertices_m.T
    swell = 1.0 + 0.32 * bumps.at(x * 1.1 + z * 0.7, y * 1.1 - z * 0.5)
    vertices = plain.vertices_m * swell[:, None] * np.array([1.0, 0.8, 0.8])
    return Surface(_STONE, vertices, plain.quads, plain.uvs_m, smooth=False)
