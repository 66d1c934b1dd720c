"""The posed hand as a surface in the world: what is rendered is what is labelled."""

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from services.worker.hand.skin import posed_hand
from services.worker.scene.library import Hand, HandLibrary
from services.worker.scene.types import Array, HandScene, SceneGeometry

Labels = npt.NDArray[np.int32]


def build_geometry(scene: HandScene, hands: HandLibrary) -> SceneGeometry:
    """Pose, subdivide and place the hand of a scene."""
    hand = hands.hand(scene.cell.gender, scene.cell.handedness)
    posed = posed_hand(hand.model, scene.angles)
    nail, palm, part = _surface_attributes(hand)
    return SceneGeometry(
        vertices_m=transformed(scene.hand_to_world, hand.surface.apply(posed.vertices_m)),
        quads=hand.surface.quads,
        uvs=hand.surface.uvs,
        nail=nail,
        palm=palm,
        part=part,
        keypoints_m=transformed(scene.hand_to_world, posed.keypoints_m),
    )


def transformed(matrix: Array, points_m: Array) -> Array:
    """Apply a (4, 4) affine transform to points (N, 3)."""
    placed: Array = points_m @ matrix[:3, :3].T + matrix[:3, 3]
    return placed


@lru_cache(maxsize=8)
def _surface_attributes(hand: Hand) -> tuple[Array, Array, Labels]:
    surface, model = hand.surface, hand.model
    return surface.apply(model.nail), surface.apply(model.palm), surface.owners(model.part)
