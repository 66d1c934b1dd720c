"""Skinning: bone transforms to posed skin and keypoints."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from services.worker.hand.angles import JointAngles
from services.worker.hand.contact.folds import folded
from services.worker.hand.corrective import corrected_m
from services.worker.hand.keypoints import TIPS, tip_flesh
from services.worker.hand.model import F8, HandModel
from services.worker.hand.pose import posed_bones
from services.worker.hand.rotation import matrices, quaternions, unit
from services.worker.hand.soft_contact import pressed


@dataclass(frozen=True, eq=False)
class PosedHand:
    """A posed hand in the elbow frame (see pose.py): metres, float64."""

    vertices_m: F8
    """(V,3)"""
    keypoints_m: F8
    """(21,3)"""
    bones: F8
    """(B,4,4) from rest to the elbow frame."""


@lru_cache(maxsize=1)
def posed_hand(model: HandModel, angles: JointAngles) -> PosedHand:
    """The model in this pose: skin and keypoints in the elbow frame.

    The last one is kept: a scene's view is judged by the hand that is then rendered, and a fist
    takes a tenth of a second.
    """
    bones = posed_bones(model, angles)
    carried_m = unpressed(model, angles, bones)
    vertices_m = pressed(model, carried_m)
    keypoints_m = blended(model.keypoints_m, model.keypoint_weights, bones)
    keypoints_m[list(TIPS)] += np.einsum("tv,vk->tk", tip_flesh(model), vertices_m - carried_m)
    return PosedHand(vertices_m, keypoints_m, bones)


def unpressed(model: HandModel, angles: JointAngles, bones: F8) -> F8:
    """The skin (V,3) as the bones carry it, folds parted; touching parts may still overlap."""
    skin = skinned(corrected_m(model, angles), model.rotation_centres_m, model.weights, bones)
    return folded(model, skin, bones)


def blended(points_m: F8, weights: F8, bones: F8) -> F8:
    """Linear blend of the bones' transforms at points (N,3) with weights (N,B)."""
    rotated = np.einsum("bij,nj->nbi", bones[:, :3, :3], points_m) + bones[:, :3, 3]
    posed: F8 = np.einsum("nb,nbi->ni", weights, rotated)
    return posed


def skinned(points_m: F8, centres_m: F8, weights: F8, bones: F8) -> F8:
    """Skin (N,3) turned about centres that move by linear blending.

    Unlike linear blending alone this keeps a finger's thickness in a bend (Le and Hodgins 2016):
    rotations are blended as quaternions, in the hemisphere of each vertex's heaviest bone.
    """
    quaternion = quaternions(bones[:, :3, :3])
    agree = np.where(quaternion @ quaternion.T < 0.0, -1.0, 1.0)
    signed = weights * agree[np.argmax(weights, axis=1)]
    rotations = matrices(unit(np.einsum("vb,bk->vk", signed, quaternion)))
    offset: F8 = np.einsum("nij,nj->ni", rotations, points_m - centres_m)
    return offset + blended(centres_m, weights, bones)
