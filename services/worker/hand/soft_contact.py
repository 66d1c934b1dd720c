"""Flesh that overlaps is pressed flat: the last step of posing.

Skinning lets fingers, and the folds of bent joints, pass through each other. Here every point of
the skin that lies inside other flesh is pushed out, each side half the way, along the other side's
normal. What is judged is the smooth surface, subdivided once; what moves is the control mesh.
Flesh is not conserved: nothing swells beside a contact. Elementwise arithmetic and sums in a fixed
order only, so the result does not depend on the number of threads.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Handedness
from services.worker.hand.contact.overlap import (
    Mask,
    Overlaps,
    RestSkin,
    Search,
    Skin,
    candidates,
    overlaps,
    summed,
)
from services.worker.hand.model import F8, I4, HandModel
from services.worker.hand.subdivide import Subdivision, refined

I8 = npt.NDArray[np.int64]

COARSE = Search(inward_m=0.004, radius_m=0.0065, aside_m=0.006, before_m=0.001)
FINE = Search(inward_m=0.0028, radius_m=0.0042, aside_m=0.0028, before_m=0.002)
CLEARANCE_M = 1.5e-4
"""Pushed apart by this much: the estimate of depth is coarser."""
PUSHES = 3
SMOOTHING = (0.5, 0.5, 0.4, 0.4, 0.3, 0.3, 0.2, 0.2, 0.1, 0.05)
"""How much each round spreads the push to the skin around: the last ones rather correct."""
MOST_M = 0.005
SEARCHED_ROUNDS = (0, 2, 4)
LIGHT_M = 1e-4
"""Overlap that needs no pressing."""


def pressed(model: HandModel, vertices_m: F8) -> F8:
    """The posed control mesh (V,3) with overlapping flesh pressed flat; metres.

    A hand that touches itself nowhere is returned unchanged.
    """
    rest = _right_at_rest(model)
    if model.handedness is Handedness.LEFT:  # so that a left hand is a right one bit for bit
        left: F8 = _pressed(rest, vertices_m * _MIRROR) * _MIRROR
        return left
    return _pressed(rest, vertices_m)


_MIRROR = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class _Rest:
    """A right hand unposed."""

    topology: "_Topology"
    control: RestSkin
    fine: RestSkin
    hand: I8
    """Control vertices that are not forearm."""


@lru_cache(maxsize=2)
def _right_at_rest(model: HandModel) -> _Rest:
    right = model if model.handedness is Handedness.RIGHT else model.mirrored()
    topology = _topology(len(right.vertices_m), right.quads.tobytes())
    fine = RestSkin.subdivided(topology.fine, right)
    return _Rest(topology, RestSkin.control(right), fine, np.flatnonzero(~right.forearm))


def _pressed(rest: _Rest, vertices_m: F8) -> F8:
    topology = rest.topology
    active = _active(rest, vertices_m)
    if not active.any():
        return vertices_m
    patch = topology.patch(active)
    shift = np.zeros_like(vertices_m)
    near = None
    for turn, share in enumerate(SMOOTHING):
        skin = Skin.smooth(topology.fine, vertices_m + shift)
        if near is None or turn in SEARCHED_ROUNDS:
            near = candidates(skin, rest.fine, patch.rows, FINE)
        pairs = near.measured(skin, FINE)
        if not (pairs.depth > LIGHT_M).any():
            break
        push = np.zeros_like(shift)
        for _ in range(PUSHES):
            push = push + patch.gathered(*_pushes(pairs, patch.spread(push), len(skin.points)))
        shift = topology.smoothed(_capped(shift + push, MOST_M), share)
    return vertices_m + shift


def _capped(shift: F8, most: float) -> F8:
    """Shifts (V,3) no longer than `most`."""
    length = np.sqrt(np.einsum("vk,vk->v", shift, shift))
    capped: F8 = shift * (most / np.maximum(length, most))[:, None]
    return capped


def _active(rest: _Rest, vertices_m: F8) -> Mask:
    """Control vertices (V,) that lie near skin that faces them."""
    posed = Skin.of(vertices_m, rest.topology.quads)
    pairs = overlaps(posed, rest.control, rest.hand, COARSE)
    active = np.zeros(len(vertices_m), np.bool_)
    active[pairs.point] = active[pairs.cover] = True
    return active


def _pushes(pairs: Overlaps, shift: F8, count: int) -> tuple[F8, F8]:
    """Half of what overlaps after a shift (W,3): ways (W,3), and which points (W,) overlap."""
    moved = np.einsum("pk,pk->p", shift[pairs.cover] - shift[pairs.point], pairs.normal)
    left = pairs.depth + moved + CLEARANCE_M
    total = np.bincount(pairs.point, pairs.weight, count)
    mean = np.bincount(pairs.point, pairs.weight * left, count) / (total + 1e-30)
    inside = (mean > 0) & (total > 0)
    way = summed(pairs.point, pairs.weight[:, None] * pairs.normal, count)
    way /= np.sqrt(np.einsum("wk,wk->w", way, way) + 1e-30)[:, None]
    return way * (0.5 * np.where(inside, mean, 0.0))[:, None], inside.astype(np.float64)


@dataclass(frozen=True, eq=False)
class _Patch:
    """The part of the subdivision that touches the active skin: its fine rows and their terms."""

    rows: I8
    row_of_term: I8
    columns: I4
    values: F8
    fine_count: int
    control_count: int

    def spread(self, shift: F8) -> F8:
        """Shift of the fine points (W,3) of a shift of control vertices (V,3)."""
        return summed(self.row_of_term, self.values[:, None] * shift[self.columns], self.fine_count)

    def gathered(self, way: F8, weight: F8) -> F8:
        """Control shift (V,3): weighted means of the ways of the fine points that lean on each."""
        share = weight[self.row_of_term] * self.values
        total = summed(self.columns, share[:, None] * way[self.row_of_term], self.control_count)
        weights = np.bincount(self.columns, share, self.control_count)
        return total / (weights + WEAKEST)[:, None]


WEAKEST = 0.1
"""A control vertex that hardly carries any overlapping skin hardly moves."""


@dataclass(frozen=True, eq=False)
class _Topology:
    """What depends on the mesh's connections alone."""

    fine: Subdivision
    quads: I4
    heads: I8
    tails: I8
    valence: F8
    row_of_term: I8

    def smoothed(self, field: F8, share: float) -> F8:
        """The field (V,3) with a share of it taken from its neighbours' mean."""
        near = summed(self.heads, field[self.tails], len(field)) / self.valence[:, None]
        return (1.0 - share) * field + share * near

    def patch(self, active: Mask) -> _Patch:
        """The rows of the fine mesh that lean on any active control vertex."""
        term = active[self.fine.columns]
        rows = np.bincount(self.row_of_term, term, self.fine.vertex_count) > 0
        keep = rows[self.row_of_term]
        return _Patch(
            np.flatnonzero(rows),
            self.row_of_term[keep],
            self.fine.columns[keep],
            self.fine.values[keep],
            self.fine.vertex_count,
            len(active),
        )


@lru_cache(maxsize=8)
def _topology(count: int, quad_bytes: bytes) -> _Topology:
    quads = np.frombuffer(quad_bytes, dtype=np.int32).reshape(-1, 4)
    fine = refined(count, quads, np.zeros((len(quads), 4, 2), np.float32), 1)
    heads = quads.astype(np.int64).reshape(-1)
    tails = np.roll(quads, -1, axis=1).astype(np.int64).reshape(-1)
    valence = np.bincount(heads, minlength=count).astype(np.float64)
    rows = np.repeat(np.arange(fine.vertex_count), np.diff(fine.starts))
    return _Topology(fine, quads, heads, tails, valence, rows)
