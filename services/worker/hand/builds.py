"""The hands of one gender: everything that shape moves, linear in the shape's weights."""

import hashlib
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender, Handedness
from services.worker.hand import rest
from services.worker.hand.bones import BONE_NAMES, PARENTS
from services.worker.hand.model import COMPILER_VERSION, F4, F8, I4, HandModel
from services.worker.hand.shape import (
    FINGER_LENGTH_SPREAD,
    FINGER_THICKNESS_SPREAD,
    SCALE_SPREAD,
    HandShape,
)

LEAN_BY_AGE = 0.8
BUILD_STRENGTH = 0.6
"""How much of the way to MakeHuman's least and most muscle and fat a shape can go."""


@dataclass(frozen=True, eq=False)
class HandFamily:
    """All right hands of a gender.

    Topology, texture coordinates, weights, palm, nails and parts are those of every shape (see
    HandModel). The points of a hand are stacked as (P,3): vertices, bone heads, bone tails,
    rotation centres, keypoints; P = 2 V + 2 B + 21.
    """

    gender: Gender
    quads: I4
    uvs: F4
    weights: F8
    nail_faces: npt.NDArray[np.bool_]
    """(F,) the quads of the nails."""
    nail: F8
    palm: F8
    forearm: npt.NDArray[np.bool_]
    part: I4
    keypoint_weights: F8
    builds_m: F8
    """(18,P,3) points of the builds in asset.CORNERS."""
    finger_length_m: F8
    """(P,3) shift when the fingers grow by their own length."""
    finger_thickness_m: F8
    """(P,3) shift when the fingers' girth doubles."""
    physiques_m: F8
    """(5,P,3) shifts of hands whose physique is not average, see physique_amounts."""
    correctives_m: F8
    """(C,V,3) shifts of the average hand's skin that come with bending, see flesh.CORRECTIVES."""
    content_hash: str
    """SHA-256 over the arrays and the compiler's version."""

    @classmethod
    def hashed(cls, **values: Any) -> "HandFamily":
        """A family with its hash."""
        return cls(**values, content_hash=content_hash(values))

    def shaped(self, shape: HandShape) -> HandModel:
        """The right hand of this shape (about a millisecond).

        The builds combine as in MakeHuman: age times muscle times weight, each linear between its
        neighbours.
        """
        shares = build_shares(shape)
        used = np.flatnonzero(shares)
        points_m = np.einsum("c,cpk->pk", shares[used], self.builds_m[used])
        points_m += shape.finger_length * FINGER_LENGTH_SPREAD * self.finger_length_m
        points_m += shape.finger_thickness * FINGER_THICKNESS_SPREAD * self.finger_thickness_m
        points_m += np.einsum("c,cpk->pk", physique_amounts(shape), self.physiques_m)
        points_m *= 1.0 + shape.scale * SCALE_SPREAD
        return self._model(points_m, shape)

    def _model(self, points_m: F8, shape: HandShape) -> HandModel:
        skin, bones = len(self.weights), len(BONE_NAMES)
        ends = np.cumsum([skin, bones, bones, skin])
        vertices_m, heads_m, tails_m, centres_m, keypoints_m = np.split(points_m, ends)
        nails = rest.nail_normals(vertices_m, self.quads[self.nail_faces], tails_m)
        hinges = rest.hinge_axes(heads_m, tails_m, nails)
        return HandModel(
            gender=self.gender,
            handedness=Handedness.RIGHT,
            vertices_m=vertices_m,
            quads=self.quads,
            uvs=self.uvs,
            weights=self.weights,
            rotation_centres_m=centres_m,
            bone_names=BONE_NAMES,
            parents=np.array(PARENTS, dtype=np.int32),
            bone_heads_m=heads_m,
            bone_tails_m=tails_m,
            hinges=hinges,
            rest_angles_deg=rest.rest_angles_deg(heads_m, tails_m, hinges),
            nail=self.nail,
            palm=self.palm,
            forearm=self.forearm,
            keypoints_m=keypoints_m,
            keypoint_weights=self.keypoint_weights,
            part=self.part,
            correctives_m=self.correctives_m * (1.0 + shape.scale * SCALE_SPREAD),
            content_hash=shaped_hash(self.content_hash, shape, Handedness.RIGHT),
        )


def build_shares(shape: HandShape) -> F8:
    """Share (18,) of each of asset.CORNERS in a shape; they sum to 1.

    The artists' extremes are those of bodies that few have: only a part of their way is gone.
    """
    age = np.array([1.0 - shape.oldness, shape.oldness])
    muscle, weight = (
        _low_mid_high(0.5 + BUILD_STRENGTH * (amount - 0.5))
        for amount in (shape.muscle, shape.weight)
    )
    shares: F8 = np.einsum("a,m,w->amw", age, muscle, weight).reshape(-1)
    return shares


def physique_amounts(shape: HandShape) -> F8:
    """How much (5,) of each of physique.physiques a shape has: bare, thin, fat, muscular, old."""
    heavier = 2.0 * shape.weight - 1.0
    return np.array(
        [
            leanness(shape),
            max(0.0, -heavier),
            max(0.0, heavier),
            2.0 * shape.muscle - 1.0,
            shape.oldness,
        ]
    )


def leanness(shape: HandShape) -> float:
    """How much of the fat under the skin of the hand's back is gone, 0..1: thin people, old people.

    Fat on the back of the hand goes with age whatever the weight.
    """
    thin = max(0.0, 1.0 - 2.0 * shape.weight)
    return min(1.0, thin + LEAN_BY_AGE * shape.oldness)


def _low_mid_high(amount: float) -> F8:
    low, high = max(0.0, 1.0 - 2.0 * amount), max(0.0, 2.0 * amount - 1.0)
    return np.array([low, 1.0 - low - high, high])


def content_hash(values: dict[str, Any]) -> str:
    """SHA-256 over names, shapes and bytes of a family's fields."""
    digest = hashlib.sha256(COMPILER_VERSION.encode())
    for field in fields(HandFamily):
        if field.name != "content_hash":
            value = values[field.name]
            digest.update(field.name.encode())
            if isinstance(value, np.ndarray):
                digest.update(f"{value.dtype.str}{value.shape}".encode())
                digest.update(np.ascontiguousarray(value).tobytes())
            else:
                digest.update(repr(value).encode())
    return digest.hexdigest()


def shaped_hash(family: str, shape: HandShape, handedness: Handedness) -> str:
    """SHA-256 of what makes one hand: its family, its shape and its side."""
    return hashlib.sha256(f"{family} {shape!r} {handedness.value}".encode()).hexdigest()
