"""What the skin needs to know of the hand under it: texels with their place, way and joints."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8, I4
from services.worker.hand.bones import BONE_INDEX, BONES
from services.worker.hand.maps import smoothstep
from services.worker.hand.model import HandModel
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit
from services.worker.hand.skinmaps.atlas import Texels, atlas_uvs, rasterised
from services.worker.hand.skinmaps.noise import octaves_of, value_noise
from services.worker.hand.subdivide import subdivision
from services.worker.hand.surface import vertex_normals

SURFACE_LEVELS = 2
MESH_MM = 5.0
"""Noise as long as this is smooth between the vertices of that surface."""
AROUND_MM = 36.0
STRETCHED = 6.0
"""A texel of so many times the middle area shows stretched skin."""
FADE_MM = 40.0
MM_PER_M = 1000.0
DORSUM_FACING = 0.35
"""Skin counts as back of the hand where it faces the dorsal way by at least this cosine."""

Mask = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Joint:
    """A hinge of a digit at rest, millimetres: unit axes along the digit, across it and dorsal."""

    digit: int
    name: str
    centre_mm: F8
    along: F8
    across: F8
    dorsal: F8

    def local_mm(self, points_mm: F8) -> F8:
        """Coordinates (N, 3) of points: along the digit (distal), across, dorsal."""
        frame = np.stack([self.along, self.across, self.dorsal])
        local_mm: F8 = np.einsum("ij,nj->ni", frame, points_mm - self.centre_mm)
        return local_mm


@dataclass(frozen=True, eq=False)
class Skin:
    """The texels of a hand at rest. T texels; millimetres; right hand.

    points_mm, normals (T, 3); vertices_mm (W, 3) of the smooth surface; facing (T,) cosine of the
    normal to the dorsal way, -1 palmar;
    glabrous (T,) 0..1 as the hand model has it; tip (T,) cosine of the normal to the way out of
    the digit's end; digit (T,) index into DIGITS or -1; forearm (T,) share 0..1; nail (T,) 0..1.
    """

    model: HandModel
    texels: Texels
    points_mm: F8
    vertices_mm: F8
    normals: F8
    facing: F8
    glabrous: F8
    tip: F8
    digit: I4
    forearm: F8
    nail: F8
    _around: dict[tuple[int, str], tuple[Rows, F8, F8]] = field(default_factory=dict)

    def noise(self, wavelength_mm: float, octaves: int, name: str, rows: Rows | None = None) -> F8:
        """Noise in about -1..1 at all texels, or at some (M,), in octaves of ever finer detail.

        What is longer than the mesh is wide is evaluated at its vertices where these are fewer.
        """
        corners = self.texels.corners if rows is None else self.texels.corners[rows]
        weights = self.texels.weights if rows is None else self.texels.weights[rows]
        coarse = np.zeros(len(self.vertices_mm), dtype=np.float32)
        fine = np.zeros(len(corners), dtype=np.float32)
        points_mm = self.points_mm if rows is None else self.points_mm[rows]
        few = len(self.vertices_mm) < len(corners)
        for number, length_mm, gain in octaves_of(wavelength_mm, octaves):
            key = f"{name}/{number}"
            if length_mm >= MESH_MM and few:
                coarse += np.float32(gain) * value_noise(self.vertices_mm, length_mm, key)
            else:
                fine += np.float32(gain) * value_noise(points_mm, length_mm, key)
        if wavelength_mm >= MESH_MM and few:
            fine += np.einsum("tk,tk->t", coarse[corners], weights)
        return fine.astype(np.float64)

    def around(self, joint: Joint) -> tuple[Rows, F8, F8]:
        """Texels (M,) of a joint's digit and the palm near it, their place in the joint's frame
        (M, 3) and squared distance (M,), mm.

        Other digits are left out, however close they lie at rest.
        """
        key = (joint.digit, joint.name)
        if key not in self._around:
            own = np.flatnonzero((self.digit == joint.digit) | (self.digit == -1))
            offset = self.points_mm[own] - joint.centre_mm
            square = np.einsum("ni,ni->n", offset, offset)
            close = square < AROUND_MM**2
            rows = own[close]
            self._around[key] = rows, joint.local_mm(self.points_mm[rows]), square[close]
        return self._around[key]

    @cached_property
    def even_area_m2(self) -> F8:
        """Area (T,) with that of stretched texels held down: the elbow's end has hardly any."""
        area_m2 = self.texels.area_m2
        held: F8 = np.minimum(area_m2, STRETCHED * np.median(area_m2))
        return held

    @cached_property
    def texel_mm(self) -> float:
        """How wide a texel of the hand is, as a rule."""
        return MM_PER_M * float(np.sqrt(np.median(self.texels.area_m2)))

    @cached_property
    def detailed(self) -> F8:
        """(T,) 1, falling to 0 where the atlas ends: what lies beyond shows its last texels."""
        along_mm = self.points_mm[:, 1]
        whole = self.texels.area_m2 < STRETCHED * np.median(self.texels.area_m2)
        end_mm = float(along_mm[whole].min())
        return smoothstep(end_mm + 4.0, end_mm + FADE_MM, along_mm)

    @property
    def dorsum(self) -> Mask:
        """(T,) the back of the hand and of the digits, nails and forearm left out."""
        return is_dorsum(self.facing, self.forearm, self.nail)


def is_dorsum(facing: F8, forearm: F8, nail: F8) -> Mask:
    """Which skin's mean colour is the hand's: what a colorimeter on the back of it would touch."""
    dorsum: Mask = (facing > DORSUM_FACING) & (forearm < 0.5) & (nail < 0.02)
    return dorsum


def skin_of_hand(model: HandModel, side_px: int) -> Skin:
    """Rasterise the smooth rest surface of a right hand in its atlas."""
    surface = subdivision(model, SURFACE_LEVELS)
    vertices_m = surface.apply(model.vertices_m)
    texels = rasterised(vertices_m, surface.quads, atlas_uvs(surface.uvs), side_px)
    normals = vertex_normals(vertices_m, surface.quads)
    weights = surface.apply(model.weights)
    part = surface.owners(model.part)
    facing, tip = facings(model, normals, weights)
    digit = _digit_of_part()[part]
    nearest = texels.corners[np.arange(texels.count), texels.weights.argmax(axis=1)]
    return Skin(
        model=model,
        texels=texels,
        points_mm=texels.sampled(vertices_m) * MM_PER_M,
        vertices_mm=vertices_m * MM_PER_M,
        normals=unit(texels.sampled(normals)),
        facing=texels.sampled(facing),
        glabrous=texels.sampled(surface.apply(model.palm)),
        tip=texels.sampled(tip),
        digit=digit[nearest],
        forearm=texels.sampled((part == PARTS.index(HandPart.FOREARM)).astype(np.float64)),
        nail=texels.sampled(surface.apply(model.nail)),
    )


def facings(model: HandModel, normals: F8, weights: F8) -> tuple[F8, F8]:
    """Cosines (W,) of normals to the dorsal way of their bones, and to the way out of the tips.

    normals (W, 3) at rest; weights (W, B).
    """
    ways = unit(model.bone_tails_m - model.bone_heads_m)
    dorsal = np.tile([0.0, 0.0, 1.0], (len(BONES), 1))
    outward = np.zeros((len(BONES), 3))
    for digit, hinge in zip(DIGITS, model.hinges, strict=True):
        for segment in ("proximal", "middle", "distal"):
            row = BONE_INDEX.get(f"{digit}_{segment}")
            if row is not None:
                dorsal[row] = unit(np.cross(ways[row], hinge))
        row = BONE_INDEX[f"{digit}_distal"]
        outward[row] = ways[row]
    dorsal_way = unit(np.einsum("vb,bk->vk", weights, dorsal))
    facing = np.einsum("vk,vk->v", normals, dorsal_way)
    return facing, np.einsum("vk,vk->v", normals, np.einsum("vb,bk->vk", weights, outward))


def joints(model: HandModel) -> tuple[Joint, ...]:
    """The knuckles of all digits: mcp, pip, dip of the fingers; mcp and ip of the thumb."""
    found = []
    for digit, (name, hinge) in enumerate(zip(DIGITS, model.hinges, strict=True)):
        for joint, before, after in _hinged_bones(name):
            found.append(_joint(model, digit, joint, (before, after), hinge))
    return tuple(found)


def _hinged_bones(digit: str) -> tuple[tuple[str, str, str], ...]:
    names = {
        segment: f"{digit}_{segment}" for segment in ("metacarpal", "proximal", "middle", "distal")
    }
    if digit == "thumb":
        return (
            ("mcp", names["metacarpal"], names["proximal"]),
            ("ip", names["proximal"], names["distal"]),
        )
    return (
        ("mcp", names["metacarpal"], names["proximal"]),
        ("pip", names["proximal"], names["middle"]),
        ("dip", names["middle"], names["distal"]),
    )


def _joint(model: HandModel, digit: int, name: str, bones: tuple[str, str], hinge: F8) -> Joint:
    before, after = (BONE_INDEX[bone] for bone in bones)
    ways = unit(model.bone_tails_m - model.bone_heads_m)
    # A metacarpal bone of the rig points to a shared joint, so only its finger tells the way.
    along = ways[after] if name == "mcp" and digit else unit(ways[before] + ways[after])
    dorsal = unit(np.cross(along, hinge))
    centre_mm = model.bone_heads_m[after] * MM_PER_M
    return Joint(digit, name, centre_mm, along, np.cross(dorsal, along), dorsal)


def _digit_of_part() -> I4:
    owners = [-1] * len(PARTS)
    for index, part in enumerate(PARTS):
        for digit, name in enumerate(DIGITS):
            if part.value.startswith(f"{name}_") and part is not HandPart.THUMB_METACARPAL:
                owners[index] = digit
    return np.array(owners, dtype=np.int32)


def near(skin: Skin, joint: Joint, reach_mm: float) -> tuple[Rows, F8]:
    """Texels (M,) no further from a joint than reach along its digit, nor than 1.8 times that in
    all (at most AROUND_MM), and their coordinates (M, 3) in its frame, mm.
    """
    rows, local_mm, square = skin.around(joint)
    here = (square < (1.8 * reach_mm) ** 2) & (np.abs(local_mm[:, 0]) < reach_mm)
    return rows[here], local_mm[here]


def bump(distance_mm: F8, width_mm: float) -> F8:
    """A Gaussian hill (N,) of height 1: exp(-(d / w)²)."""
    hill: F8 = np.exp(-((distance_mm / width_mm) ** 2))
    return hill


def dorsal_share(facing: F8) -> F8:
    """(N,) 0 on the sides and below, 1 on top."""
    return smoothstep(0.0, 0.7, facing)


def palmar_share(facing: F8) -> F8:
    """(N,) 0 on the sides and above, 1 on the pulp."""
    return smoothstep(-0.1, 0.55, -facing)
