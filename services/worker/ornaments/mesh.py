"""What an ornament is made of: closed surfaces of quads, each of one material."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import numpy.typing as npt

F8 = npt.NDArray[np.float64]
F4 = npt.NDArray[np.float32]
I4 = npt.NDArray[np.int32]
Rgb = tuple[float, float, float]


class OrnamentName(StrEnum):
    """What labels call the thing that hides a keypoint."""

    RING = "ring"
    WRIST_WEAR = "wrist_wear"
    SLEEVE = "sleeve"


class Pattern(StrEnum):
    """How a cloth's two colours lie on it, along its UVs."""

    PLAIN = "plain"
    STRIPES = "stripes"
    CHECK = "check"


@dataclass(frozen=True)
class Cloth:
    """Woven or knitted: a second colour every `repeat_m`, threads or stitches `stitch_m` wide."""

    pattern: Pattern
    second_rgb: Rgb
    repeat_m: float
    stitch_m: float
    knitted: bool
    sheen: float


@dataclass(frozen=True)
class OrnamentMaterial:
    """Linear Rec. 709 colour: diffuse albedo, or with metallic 1 the reflectance head on (F0)."""

    base_rgb: Rgb
    metallic: float = 0.0
    roughness: float = 0.4
    coat: float = 0.0
    ior: float = 1.5
    cloth: Cloth | None = None


@dataclass(frozen=True, eq=False)
class OrnamentMesh:
    """A closed surface: vertices_m (N, 3) f8, quads (M, 4) i4 outward, uvs_m (M, 4, 2) f4.

    A quad at a pole has two corners at one place. uvs_m are metres on the cloth.
    """

    name: OrnamentName
    vertices_m: F8
    quads: I4
    uvs_m: F4
    smooth: bool
    material: OrnamentMaterial

    def placed(self, matrix: F8) -> "OrnamentMesh":
        """Return the mesh moved by a rigid (4, 4) transform."""
        moved = np.einsum("ij,nj->ni", matrix[:3, :3], self.vertices_m) + matrix[:3, 3]
        return replace(self, vertices_m=moved)


@dataclass(frozen=True, eq=False)
class Surface:
    """A closed surface that has no name and material yet."""

    vertices_m: F8
    quads: I4
    uvs_m: F4

    def of(
        self, name: OrnamentName, material: OrnamentMaterial, *, smooth: bool = True
    ) -> OrnamentMesh:
        """Return it as an ornament."""
        return OrnamentMesh(name, self.vertices_m, self.quads, self.uvs_m, smooth, material)


def joined(surfaces: Iterable[Surface]) -> Surface:
    """Return surfaces as one."""
    parts = list(surfaces)
    starts = np.cumsum([0, *(len(part.vertices_m) for part in parts[:-1])])
    return Surface(
        np.concatenate([part.vertices_m for part in parts]),
        np.concatenate(
            [part.quads + start for part, start in zip(parts, starts, strict=True)]
        ).astype(np.int32),
        np.concatenate([part.uvs_m for part in parts]),
    )


def torus(points_m: F8, u_m: F8 | None = None, v_m: F8 | None = None) -> Surface:
    """Return the surface of a grid (K, P, 3) that is closed both ways, wound outward.

    u_m (P + 1,) and v_m (K + 1,) are the UVs along it, the last ones back at the start.
    """
    rings, around = points_m.shape[:2]
    u = np.linspace(0.0, 1.0, around + 1) if u_m is None else u_m
    v = np.linspace(0.0, 1.0, rings + 1) if v_m is None else v_m
    return _grid(points_m, u, v, rings)


def ball(points_m: F8) -> Surface:
    """Return the surface of rings (K, P, 3), the first and last a point each, wound outward."""
    rings, around = points_m.shape[:2]
    return _grid(points_m, np.linspace(0, 1, around + 1), np.linspace(0, 1, rings), rings - 1)


def _grid(points_m: F8, u_m: F8, v_m: F8, steps: int) -> Surface:
    rings, around = points_m.shape[:2]
    k, p = (index.reshape(-1) for index in np.indices((steps, around)))
    up, on = (k + 1) % rings, (p + 1) % around
    quads = np.stack([k * around + p, k * around + on, up * around + on, up * around + p], axis=1)
    uvs = np.stack(
        [
            np.stack([u_m[a], v_m[b]], axis=1)
            for a, b in ((p, k), (p + 1, k), (p + 1, k + 1), (p, k + 1))
        ],
        axis=1,
    )
    vertices = points_m.reshape(-1, 3)
    if _volume(vertices, quads) < 0:
        quads, uvs = quads[:, ::-1], uvs[:, ::-1]
    return Surface(
        vertices, np.ascontiguousarray(quads, np.int32), np.ascontiguousarray(uvs, np.float32)
    )


def _volume(vertices: F8, quads: npt.NDArray[np.intp]) -> float:
    """Return six times the signed volume inside a closed surface."""
    a, b, c, d = np.moveaxis((vertices - vertices.mean(axis=0))[quads], 1, 0)
    first = np.einsum("qk,qk->", a, np.cross(b, c))
    return float(first + np.einsum("qk,qk->", a, np.cross(c, d)))
