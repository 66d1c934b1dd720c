"""The folds of bent joints: skin on either side of a joint stays on its own side.

A hinge bent far lets the skin in front of and behind it pass through each other. By symmetry the
two sides of a real fold meet on the plane that halves the bend; what has crossed it is laid on it.
The flesh so taken away swells sideways.
"""

from dataclasses import dataclass

import numpy as np

from hi5_common.domain.vocabulary import Handedness
from services.worker.hand.bones import BONE_INDEX, BONES, FINGERS
from services.worker.hand.maps import smoothstep
from services.worker.hand.model import F8, HandModel
from services.worker.hand.parts import HandPart
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit

REACH_M = 0.022
"""Skin farther than this from a joint (at rest) is no part of its fold."""
LIE_M = 4e-4
"""How far from the plane folded skin comes to lie, either side."""
CREASE = 0.18
"""Spread of the weight about one half of the skin in the crease itself."""


@dataclass(frozen=True)
class Fold:
    """A joint: its digit, the bone before it, the bone after it, and all bones on either side."""

    digit: int
    before: int
    after: int
    proximal: tuple[int, ...]
    distal: tuple[int, ...]


def _folds() -> tuple[Fold, ...]:
    palm = tuple(k for k, bone in enumerate(BONES) if bone.part is HandPart.PALM)
    folds = []
    for digit in (*FINGERS, "thumb"):
        names = ["metacarpal", "proximal", "middle", "distal"]
        chain = [BONE_INDEX[f"{digit}_{name}"] for name in names if f"{digit}_{name}" in BONE_INDEX]
        for at in range(1, len(chain)):
            before = palm if at == 1 and digit != "thumb" else (*chain[:at],)
            folds.append(
                Fold(DIGITS.index(digit), chain[at - 1], chain[at], before, tuple(chain[at:]))
            )
    return tuple(folds)


FOLDS = _folds()


def folded(model: HandModel, vertices_m: F8, bones: F8) -> F8:
    """The skinned control mesh (V,3) with every fold's two sides parted; bones (B,4,4)."""
    shift = np.zeros_like(vertices_m)
    for fold in FOLDS:
        _part(model, vertices_m, bones, fold, shift)
    return vertices_m + shift


def _part(model: HandModel, vertices_m: F8, bones: F8, fold: Fold, shift: F8) -> None:
    """Add to `shift` what keeps both sides of one joint on their side of its plane."""
    # The rest pose folds nothing, and the bones of the palm do not point along its fingers: the way
    # before the joint is that of the segment behind it, had the joint not moved.
    straight = unit(model.bone_tails_m[fold.after] - model.bone_heads_m[fold.after])
    before, after = (bones[k, :3, :3] @ straight for k in (fold.before, fold.after))
    part = _flexed_share(model, fold, bones, before, after)
    if part == 0.0:
        return
    normal = unit(before + after)
    head = model.bone_heads_m[fold.after]
    joint = bones[fold.after, :3, :3] @ head + bones[fold.after, :3, 3]
    inner = unit(after - before)
    proximal = model.weights[:, fold.proximal].sum(axis=1)
    distal = model.weights[:, fold.distal].sum(axis=1)
    belongs = np.flatnonzero(proximal + distal > 0.6)
    lean = (distal[belongs] - proximal[belongs]) / (distal[belongs] + proximal[belongs])
    ring = np.exp(-((lean / CREASE) ** 2))[:, None]
    centre = (ring * model.vertices_m[belongs]).sum(axis=0) / (ring.sum() + 1e-9)
    near = np.linalg.norm(model.vertices_m[belongs] - centre, axis=1) < REACH_M
    rows, share = belongs[near], lean[near]
    away = vertices_m[rows] - joint
    height, depth = away @ normal, away @ inner
    crease = np.exp(-((share / CREASE) ** 2)) * np.clip(depth / 0.004, 0.0, 1.0)
    middle = float(np.sum(crease * height) / (np.sum(crease) + 1e-9))
    side = np.sign(share)
    own = side * (height - middle)
    least = LIE_M * np.clip(np.abs(share) / CREASE, 0.0, 1.0)
    lift = np.where(depth > 0.0, np.maximum(least - own, 0.0), 0.0)
    shift[rows] += part * (side * lift)[:, None] * normal


def _flexed_share(model: HandModel, fold: Fold, bones: F8, before: F8, after: F8) -> float:
    """How much of a fold (0..1) a bend makes. Bends to the side make none, whatever their angle."""
    hinge = model.hinges[fold.digit]
    if model.handedness is Handedness.LEFT:
        hinge = hinge * np.array([-1.0, 1.0, 1.0])
    across = np.cross(before, after) @ (bones[fold.before, :3, :3] @ hinge)
    bend_deg = np.degrees(np.arctan2(abs(across), before @ after))
    return float(smoothstep(*FOLDING_DEG, bend_deg))


FOLDING_DEG = (15.0, 30.0)
"""Bends over which a joint begins to fold its skin."""
