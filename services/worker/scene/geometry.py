"""The posed hand as a surface in the world: what is rendered is what is labelled."""

from dataclasses import replace

import numpy as np

from services.worker.hand.skin import PosedHand, posed_hand
from services.worker.hand.skinmaps.slack import slack
from services.worker.ornaments.fit import fitted
from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import OrnamentMesh
from services.worker.ornaments.worn import BARE, Worn
from services.worker.scene.library import Hand, HandLibrary
from services.worker.scene.types import Array, Camera, HandScene, SceneGeometry

FAR_M = 2.0
"""Single precision has a ten-thousandth of a millimetre there."""


def build_geometry(scene: HandScene, hands: HandLibrary) -> SceneGeometry:
    """Pose, subdivide, place and dress the hand of a scene."""
    hand = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape)
    posed = posed_hand(hand.model, scene.angles)
    maps = hand.topology.maps
    return SceneGeometry(
        vertices_m=transformed(scene.hand_to_world, hand.surface.apply(posed.vertices_m)),
        quads=hand.surface.quads,
        uvs=hand.surface.uvs,
        nail=maps.nail,
        palm=maps.palm,
        slack=hand.surface.apply(slack(hand.model, scene.angles)),
        part=maps.part,
        keypoints_m=transformed(scene.hand_to_world, posed.keypoints_m),
        ornaments=tuple(
            ornament.placed(scene.hand_to_world)
            for ornament in ornaments_on(scene.worn, hand, posed)
        ),
    )


def ornaments_on(worn: Worn, hand: Hand, posed: PosedHand) -> tuple[OrnamentMesh, ...]:
    """Fit what is worn to the posed hand; meshes in its elbow frame."""
    if worn == BARE:
        return ()
    skin_m = hand.surface.apply(posed.vertices_m)
    part = hand.topology.maps.part
    limbs = PosedLimbs(skin_m, hand.surface.quads, part, posed.keypoints_m, posed.bones)
    return fitted(worn, limbs)


def near_origin(camera: Camera, geometry: SceneGeometry) -> tuple[Camera, SceneGeometry]:
    """Return the same view with the hand at the origin, if it is farther than FAR_M from it.

    A renderer counts in single precision: a hand 10 km away would be drawn on a grid of a
    millimetre. What is lit by an environment looks the same wherever it is.
    """
    middle_m = geometry.keypoints_m.mean(axis=0)
    if np.linalg.norm(middle_m) <= FAR_M:
        return camera, geometry
    home, back = np.eye(4), np.eye(4)
    home[:3, 3], back[:3, 3] = -middle_m, middle_m
    moved = replace(
        geometry,
        vertices_m=transformed(home, geometry.vertices_m),
        keypoints_m=transformed(home, geometry.keypoints_m),
        ornaments=tuple(ornament.placed(home) for ornament in geometry.ornaments),
    )
    return replace(camera, world_to_camera=camera.world_to_camera @ back), moved


def transformed(matrix: Array, points_m: Array) -> Array:
    """Apply a (4, 4) affine transform to points (N, 3)."""
    placed: Array = points_m @ matrix[:3, :3].T + matrix[:3, 3]
    return placed
