"""Pairs of skin points of which one lies behind the other's skin: an estimate, made for speed."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.hand.contact.near import near_pairs
from services.worker.hand.model import F8, I4, HandModel
from services.worker.hand.parts import DIGIT_OF_PART, PARTS
from services.worker.hand.subdivide import Subdivision

I8 = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]

FACING = -0.1
"""Cosine between normals of skin that faces other skin."""
SIDEWAYS = 0.5
"""Skin of far parts may be met sideways, as by the end of a finger."""
FAR_AT_REST_M = 0.012
THICKNESS_M = 0.03
"""Two sides of one piece of flesh are never farther apart than this at rest."""
GLABROUS = 0.5
OPPOSITE = -0.5
"""Cosine between normals at rest of skin on opposite sides of a digit."""
_DIGITS = np.array([DIGIT_OF_PART[part] for part in PARTS])


@dataclass(frozen=True, eq=False)
class Skin:
    """Points (N,3) of a surface and their outward unit normals (N,3)."""

    points: F8
    normals: F8

    @classmethod
    def of(cls, points: F8, quads: I4) -> "Skin":
        """The vertices of a quad mesh."""
        return cls(points, normals_of(points, quads))

    @classmethod
    def smooth(cls, fine: Subdivision, control_m: F8) -> "Skin":
        """The vertices of the subdivided mesh."""
        return cls.of(fine.apply(control_m), fine.quads)


@dataclass(frozen=True, eq=False)
class RestSkin(Skin):
    """The skin of a hand unposed."""

    back: Mask
    """(N,) hairy skin: the back of the hand, the back and the sides of the digits."""
    part: I4
    """(N,) index into PARTS."""

    @classmethod
    def control(cls, model: HandModel) -> "RestSkin":
        """The vertices of the control mesh."""
        normals = normals_of(model.vertices_m, model.quads)
        return cls(model.vertices_m, normals, model.palm < GLABROUS, model.part)

    @classmethod
    def subdivided(cls, fine: Subdivision, model: HandModel) -> "RestSkin":
        """The vertices of the subdivided mesh."""
        smooth = Skin.smooth(fine, model.vertices_m)
        back = fine.apply(model.palm) < GLABROUS
        return cls(smooth.points, smooth.normals, back, fine.owners(model.part))


@dataclass(frozen=True)
class Search:
    """Where the skin that covers a point is looked for: in a ball about a place inside.

    The ball's centre lies `inward_m` behind the point; skin beside the point by more than
    `aside_m` or in front of it by more than `before_m` covers nothing.
    """

    inward_m: float
    radius_m: float
    aside_m: float
    before_m: float


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Pairs (P,): `point` lies `depth` metres behind the skin at `cover`, along `normal` (P,3)."""

    point: I8
    cover: I8
    normal: F8
    depth: F8
    weight: F8


@dataclass(frozen=True, eq=False)
class Candidates:
    """Pairs (P,) of skin points that may come to cover each other."""

    point: I8
    cover: I8

    def measured(self, skin: Skin, search: Search) -> Overlaps:
        """Those that do so on this skin."""
        way, normal = skin.points[self.cover] - skin.points[self.point], skin.normals[self.cover]
        depth = np.einsum("pk,pk->p", way, normal)
        aside = np.einsum("pk,pk->p", way, way) - depth * depth
        keep = (depth > -search.before_m) & (aside < search.aside_m**2)
        keep &= depth < search.inward_m + search.radius_m
        weight = np.exp(-3.0 * aside[keep] / search.aside_m**2)
        return Overlaps(self.point[keep], self.cover[keep], normal[keep], depth[keep], weight)


def candidates(skin: Skin, rest: RestSkin, rows: I8, search: Search) -> Candidates:
    """The pairs among `rows` of the skin; rest is the same skin unposed."""
    points, normals = skin.points[rows], skin.normals[rows]
    first, second = near_pairs(points - search.inward_m * normals, points, search.radius_m)
    facing = np.einsum("pk,pk->p", normals[first], normals[second])
    some = np.flatnonzero(facing < SIDEWAYS)
    point, cover, facing = rows[first[some]], rows[second[some]], facing[some]
    keep = _other_flesh(rest, point, cover, facing)
    return Candidates(point[keep], cover[keep])


def overlaps(skin: Skin, rest: RestSkin, rows: I8, search: Search) -> Overlaps:
    """The pairs among `rows` that cover each other; rest is the same skin unposed."""
    return candidates(skin, rest, rows, search).measured(skin, search)


def _other_flesh(rest: RestSkin, point: I8, cover: I8, facing: F8) -> Mask:
    """Pairs that are not the two sides of one piece of flesh, nor neighbours on one skin.

    A bent joint seen from its back is an edge, whose sides lie behind each other as those of an
    overlap do. But a digit folds with its palmar skin alone, and no segment onto itself.
    """
    way = rest.points[cover] - rest.points[point]
    square = np.einsum("pk,pk->p", way, way)
    behind = np.einsum("pk,pk->p", way, rest.normals[cover]) > 0.0
    cosine = np.einsum("pk,pk->p", rest.normals[point], rest.normals[cover])
    two_sides = behind & (cosine < 0.0)
    digit = _DIGITS[rest.part[point]]
    edge = (rest.back[point] | rest.back[cover]) & (cosine > OPPOSITE)
    edge &= (digit > 0) & (digit == _DIGITS[rest.part[cover]])
    one_piece = (two_sides | edge) & (square < THICKNESS_M**2)
    other: Mask = ((facing < FACING) | (square > FAR_AT_REST_M**2)) & ~one_piece
    return other


def normals_of(points: F8, quads: I4) -> F8:
    """Area-weighted unit normals (V,3) of a quad mesh (F,4)."""
    a, b, c, d = (points[quads[:, k]] for k in range(4))
    p, q = c - a, d - b
    faces = np.stack(
        [
            p[:, 1] * q[:, 2] - p[:, 2] * q[:, 1],
            p[:, 2] * q[:, 0] - p[:, 0] * q[:, 2],
            p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0],
        ],
        axis=1,
    )
    total = summed(quads.reshape(-1), np.repeat(faces, 4, axis=0), len(points))
    normals: F8 = total / np.sqrt(np.einsum("vk,vk->v", total, total) + 1e-30)[:, None]
    return normals


def summed(rows: npt.NDArray[np.integer], values: F8, count: int) -> F8:
    """Sums (count,3) of values (N,3) by row, in the order given."""
    return np.stack([np.bincount(rows, values[:, k], count) for k in range(3)], axis=1)
