"""How a hand's points move as its fingers grow longer or thicker: fields linear in the amount."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from services.worker.hand.asset import F8
from services.worker.hand.bones import BONE_INDEX, FINGERS
from services.worker.hand.rotation import unit

PHALANGES: dict[str, tuple[str, ...]] = {"thumb": ("proximal", "distal")} | dict.fromkeys(
    FINGERS, ("proximal", "middle", "distal")
)
"""The free segments of each digit."""


def phalanx_rows(digit: str) -> list[int]:
    """Rows of the bones of a digit's free segments, proximal first."""
    return [BONE_INDEX[f"{digit}_{segment}"] for segment in PHALANGES[digit]]


@dataclass(frozen=True, eq=False)
class Field:
    """A shift of a hand's points: vertices (V,3), bone heads and tails (B,3), metres."""

    vertices_m: F8
    heads_m: F8
    tails_m: F8


EVERY_LENGTH: dict[str, tuple[float, ...]] = {
    digit: (1.0,) * len(segments) for digit, segments in PHALANGES.items()
}


def finger_length_field(
    vertices_m: F8,
    weights: F8,
    heads_m: F8,
    tails_m: F8,
    amounts: Mapping[str, tuple[float, ...]] = EVERY_LENGTH,
) -> Field:
    """How points move when free segments grow by `amounts` of their own length, proximal first.

    A segment stretches along its bone and carries those after it, so fingers keep their
    proportions; skin follows its bones by their weights.
    """
    shift = Field(np.zeros_like(vertices_m), np.zeros_like(heads_m), np.zeros_like(tails_m))
    for digit, shares in amounts.items():
        carried = np.zeros(3)
        for row, share in zip(phalanx_rows(digit), shares, strict=True):
            bone = share * (tails_m[row] - heads_m[row])
            axis = unit(tails_m[row] - heads_m[row])
            along = np.maximum(np.einsum("vk,k->v", vertices_m - heads_m[row], axis), 0.0)
            shift.heads_m[row] = carried
            shift.vertices_m[:] += weights[:, row, None] * (carried + share * along[:, None] * axis)
            carried = carried + bone
            shift.tails_m[row] = carried
    return shift


@dataclass(frozen=True, eq=False)
class FingerFlesh:
    """The skin of one digit about its middle line.

    share (V,) 0..1 of the digit in each vertex; along_m (V,) metres from the line's first point;
    radial_m (V,3) from the nearest point of the line to the vertex.
    """

    share: F8
    along_m: F8
    radial_m: F8


def finger_flesh(vertices_m: F8, weights: F8, digit: str, line_m: F8) -> FingerFlesh:
    """Measure a digit's skin against its middle line (K,3), base to tip, longer before than needed.

    The line runs on beyond its first point, not beyond its last: the tip grows in all directions.
    """
    starts, steps = line_m[:-1], np.diff(line_m, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    offset = vertices_m[:, None] - starts
    t = np.einsum("vsk,sk->vs", offset, steps) / lengths**2
    t = np.clip(t, np.where(np.arange(len(steps)) == 0, -np.inf, 0.0), 1.0)
    feet = starts + t[..., None] * steps
    near = np.argmin(np.linalg.norm(vertices_m[:, None] - feet, axis=2), axis=1)
    rows = np.arange(len(vertices_m))
    before = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    return FingerFlesh(
        weights[:, phalanx_rows(digit)].sum(axis=1),
        before[near] + t[rows, near] * lengths[near],
        vertices_m - feet[rows, near],
    )


WRIST_RAMP_M = (0.028, -0.012)
"""Over this range along the hand the heel of the hand runs into the wrist."""


def forearm_girth_shift_m(vertices_m: F8, elbow_m: F8, wrist_m: F8) -> F8:
    """Shift (V,3) that doubles the girth of wrist and forearm, fading into the heel of the hand."""
    way = unit(wrist_m - elbow_m)
    offset = vertices_m - wrist_m
    radial = offset - np.einsum("vk,k->v", offset, way)[:, None] * way
    ramp = np.clip((WRIST_RAMP_M[0] - vertices_m[:, 1]) / np.ptp(WRIST_RAMP_M), 0.0, 1.0)
    smooth = ramp * ramp * (3.0 - 2.0 * ramp)
    shift: F8 = smooth[:, None] * radial
    return shift
