"""Meshes of simple things, in metres: boxes, sheets, rods, balls, leaves and landscapes."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from services.worker.places.place import Array, Finish, Point, Surface

Quads = npt.NDArray[np.int32]
_BOX_QUADS = np.array(
    [[0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6], [4, 5, 7, 6], [2, 3, 1, 0]]
)


def boxes(finish: Finish, extents: Sequence[tuple[Point, Point]]) -> Surface:
    """Return axis-aligned boxes given by their lowest and highest corners."""
    low = np.array([extent[0] for extent in extents], dtype=np.float64).reshape(-1, 3)
    high = np.array([extent[1] for extent in extents], dtype=np.float64).reshape(-1, 3)
    pick = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    vertices = np.where(pick[None] == 1, high[:, None], low[:, None]).reshape(-1, 3)
    quads = (_BOX_QUADS[None] + 8 * np.arange(len(low))[:, None, None]).reshape(-1, 4)
    return _surface(finish, vertices, quads)


def box(finish: Finish, low: Point, high: Point) -> Surface:
    """Return one axis-aligned box."""
    return boxes(finish, [(low, high)])


def moved(surface: Surface, to_m: Point, turn_rad: float = 0.0, size: float = 1.0) -> Surface:
    """Return a surface scaled, turned about the vertical and carried to a place."""
    cosine, sine = math.cos(turn_rad), math.sin(turn_rad)
    x, y, z = (surface.vertices_m * size).T
    vertices = np.stack([x * cosine - y * sine, x * sine + y * cosine, z], axis=-1) + np.array(to_m)
    return Surface(surface.finish, vertices, surface.quads, surface.uvs_m, surface.smooth)


def sheet(finish: Finish, corner: Point, across: Point, along: Point) -> Surface:
    """Return one rectangle from a corner and its two sides; its front is across x along."""
    start, side, up = (np.array(value, dtype=np.float64) for value in (corner, across, along))
    vertices = np.stack([start, start + side, start + side + up, start + up])
    width, height = np.linalg.norm(side), np.linalg.norm(up)
    uvs = np.array([[[0, 0], [width, 0], [width, height], [0, height]]], dtype=np.float64)
    return Surface(finish, vertices, np.array([[0, 1, 2, 3]], dtype=np.int32), uvs)


def rod(
    finish: Finish, low: Point, height_m: float, radii_m: tuple[float, float], sides: int = 16
) -> Surface:
    """Return an upright cylinder or cone, from its bottom's middle; radii at bottom and top."""
    angles = np.arange(sides) * (2.0 * math.pi / sides)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(sides)], axis=-1)
    lift = np.array([0.0, 0.0, height_m])
    centre = np.zeros((1, 3))
    vertices = np.concatenate([ring * radii_m[0], ring * radii_m[1] + lift, centre, centre + lift])
    near = np.arange(sides)
    far = (near + 1) % sides
    side = np.stack([near, far, far + sides, near + sides], axis=-1)
    top = np.full(sides, 2 * sides + 1)
    floor = np.full(sides, 2 * sides)
    lid = np.stack([near + sides, far + sides, top, top], axis=-1)
    base = np.stack([far, near, floor, floor], axis=-1)
    return _surface(
        finish, vertices + np.array(low), np.concatenate([side, lid, base]), smooth=True
    )


def ball(finish: Finish, middle: Point, radius_m: float, flat: float = 1.0) -> Surface:
    """Return a ball of 16 by 10 faces; `flat` scales its height."""
    return lathe(
        finish,
        middle,
        [
            (radius_m * math.sin(a), -radius_m * flat * math.cos(a))
            for a in np.linspace(0.0, math.pi, 11)
        ],
    )


def lathe(finish: Finish, low: Point, profile: Sequence[tuple[float, float]]) -> Surface:
    """Return a turned body: (radius, height) pairs from bottom to top about an upright axis."""
    sides = 20
    angles = np.arange(sides) * (2.0 * math.pi / sides)
    rings = [
        np.stack([r * np.cos(angles), r * np.sin(angles), np.full(sides, z)], axis=-1)
        for r, z in profile
    ]
    vertices = np.concatenate(rings) + np.array(low)
    return _surface(finish, vertices, grid_quads(len(profile), sides, closed=True), smooth=True)


def grid_quads(rows: int, columns: int, *, closed: bool = False) -> Quads:
    """Return the quads (Q, 4) of a grid of vertices in row order; `closed` joins the columns."""
    wide = columns if closed else columns - 1
    row = np.arange(rows - 1)[:, None] * columns
    left = np.arange(wide)[None]
    right = (left + 1) % columns
    quads = np.stack(
        [row + left, row + right, row + columns + right, row + columns + left], axis=-1
    )
    return quads.reshape(-1, 4).astype(np.int32)


def leaves(
    finish: Finish,
    rng: np.random.Generator,
    count: int,
    radii_m: Point,
    leaf_m: float,
) -> Surface:
    """Return leaves scattered in clumps through an ellipsoid about the origin."""
    clumps = max(count // 60, 4)
    middles = _in_ball(rng, clumps) * 0.72
    spread = 0.42
    at = middles[rng.integers(0, clumps, count)] + _in_ball(rng, count) * spread
    at = at * np.array(radii_m)
    first = _unit(rng.normal(size=(count, 3)))
    second = _unit(np.cross(first, rng.normal(size=(count, 3))))
    size = leaf_m * rng.uniform(0.6, 1.3, count)[:, None]
    corners = [
        at - first * size,
        at - second * size * 0.5,
        at + first * size,
        at + second * size * 0.5,
    ]
    vertices = np.stack(corners, axis=1).reshape(-1, 3)
    quads = np.arange(4 * count).reshape(-1, 4)
    # One texture coordinate a leaf: the shader colours each as a whole.
    uvs = np.repeat(rng.uniform(0.0, 50.0, (count, 1, 2)), 4, axis=1)
    return Surface(finish, vertices, quads.astype(np.int32), uvs)


def land(finish: Finish, radii_m: Array, heights_m: Array, *, smooth: bool = True) -> Surface:
    """Return ground on rings about the origin: radii (R,), heights (R, S) at S azimuths."""
    rings, sides = heights_m.shape
    angles = np.arange(sides) * (2.0 * math.pi / sides)
    x = radii_m[:, None] * np.cos(angles)
    y = radii_m[:, None] * np.sin(angles)
    vertices = np.stack([x, y, heights_m], axis=-1).reshape(-1, 3)
    quads = grid_quads(rings, sides, closed=True)
    return Surface(finish, vertices, quads, vertices[quads][..., :2].copy(), smooth)


def merged(surfaces: Sequence[Surface]) -> tuple[Surface, ...]:
    """Return the surfaces with those of one finish joined to one mesh: Blender likes few."""
    groups: dict[tuple[Finish, bool], list[Surface]] = {}
    for surface in surfaces:
        groups.setdefault((surface.finish, surface.smooth), []).append(surface)
    return tuple(_joined(group) for group in groups.values())


def _joined(group: Sequence[Surface]) -> Surface:
    starts = np.cumsum([0, *(len(surface.vertices_m) for surface in group[:-1])])
    return Surface(
        group[0].finish,
        np.concatenate([surface.vertices_m for surface in group]),
        np.concatenate([s.quads + start for s, start in zip(group, starts, strict=True)]),
        np.concatenate([surface.uvs_m for surface in group]),
        group[0].smooth,
    )


def _surface(
    finish: Finish, vertices: Array, quads: npt.NDArray[np.int64] | Quads, *, smooth: bool = False
) -> Surface:
    faces = np.ascontiguousarray(quads, dtype=np.int32)
    return Surface(finish, vertices, faces, _uvs_m(vertices, faces), smooth)


def _uvs_m(vertices: Array, quads: Quads) -> Array:
    """Return texture coordinates in metres: the two axes a face is most along (upright ones: z)."""
    corners = vertices[quads]
    normal = np.abs(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    main = normal.argmax(axis=1)
    first = np.where(main == 0, 1, 0)
    second = np.where(main == 2, 1, 2)
    pick = np.stack([first, second], axis=-1)[:, None, :].repeat(4, axis=1)
    uvs: Array = np.take_along_axis(corners, pick, axis=2)
    return uvs


def _in_ball(rng: np.random.Generator, count: int) -> Array:
    inside: Array = _unit(rng.normal(size=(count, 3))) * rng.uniform(0, 1, (count, 1)) ** (1 / 3)
    return inside


def _unit(vectors: Array) -> Array:
    unit: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit
