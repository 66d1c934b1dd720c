"""A label's pixels against the oracle's, also where floats are strained."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from benchmarks.stability.oracle import oracle_px
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from services.worker.hand.keypoints import TIPS, tip_flesh
from services.worker.hand.pose import posed_bones
from services.worker.hand.skin import posed_hand, unpressed
from services.worker.label.projection import to_camera, to_pixels
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import Camera, HandScene, Intrinsics

PLACES = 300
"""Drawn scenes are taken from this many."""
SENSOR_MM = 36.0


def drawn(hands: HandLibrary, index: int) -> HandScene:
    """Return a scene as a dataset draws it."""
    spec = parse_spec({"count": PLACES, "seed": 5, "image": {"width": 640, "height": 640}})
    return sample_scene(spec, Plan.of(spec), index, hands)


def shifts_m(scene: HandScene, hands: HandLibrary) -> npt.NDArray[np.float64]:
    """Return what pressed flesh adds to the tips, (21, 3)."""
    model = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape).model
    carried_m = unpressed(model, scene.angles, posed_bones(model, scene.angles))
    moved_m = posed_hand(model, scene.angles).vertices_m - carried_m
    shifts = np.zeros((21, 3))
    shifts[list(TIPS)] = tip_flesh(model) @ moved_m
    return shifts


def worst_px(scene: HandScene, hands: HandLibrary) -> float:
    """Return the farthest that a label's pixel is from the oracle's.

    Raises AssertionError where they do not agree on what is behind the camera.
    """
    model = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape).model
    wanted = oracle_px(scene, model, shifts_m(scene, hands))
    keypoints_m = build_geometry(scene, hands).keypoints_m
    found = to_pixels(scene.camera.intrinsics, to_camera(scene.camera, keypoints_m))
    worst = 0.0
    for (x, y), place in zip(found.tolist(), wanted, strict=True):
        if np.isnan(x) != (place is None):
            raise AssertionError("label and oracle differ on what lies behind the camera")
        if place is not None:
            worst = max(worst, abs(float(place[0] - x)), abs(float(place[1] - y)))
    return worst


def single_px(scene: HandScene, hands: HandLibrary) -> float:
    """Return the farthest that pixels computed in float32 are from the label's."""
    keypoints_m = build_geometry(scene, hands).keypoints_m
    matrix = scene.camera.world_to_camera.astype(np.float32)
    camera_m = keypoints_m.astype(np.float32) @ matrix[:3, :3].T + matrix[:3, 3]
    lens = scene.camera.intrinsics
    single = to_pixels(lens, camera_m.astype(np.float64))
    return float(np.nanmax(np.abs(single - to_pixels(lens, to_camera(scene.camera, keypoints_m)))))


def shifted(scene: HandScene, away_m: float) -> HandScene:
    """Return the same picture, hand and camera away_m from the origin."""
    away = away_m * np.array([2.0, -1.0, 2.0]) / 3.0
    placed = scene.hand_to_world.copy()
    placed[:3, 3] += away
    looked = scene.camera.world_to_camera.copy()
    looked[:3, 3] -= looked[:3, :3] @ away
    return replace(scene, hand_to_world=placed, camera=Camera(scene.camera.intrinsics, looked))


def through_lens(scene: HandScene, focal_mm: float) -> HandScene:
    """Return the scene through another lens, of a sensor 36 mm wide."""
    lens = scene.camera.intrinsics
    focal_px = focal_mm / SENSOR_MM * lens.width_px
    longer = Intrinsics(focal_px, focal_px, lens.cx_px, lens.cy_px, lens.width_px, lens.height_px)
    return replace(scene, camera=Camera(longer, scene.camera.world_to_camera))


def backed(scene: HandScene, hands: HandLibrary, depth_m: float) -> HandScene:
    """Return the scene, its camera moved until the wrist lies depth_m before the camera's plane."""
    camera_m = to_camera(scene.camera, build_geometry(scene, hands).keypoints_m)
    looked = scene.camera.world_to_camera.copy()
    looked[2, 3] += depth_m - camera_m[0, 2]
    return replace(scene, camera=Camera(scene.camera.intrinsics, looked))


def from_within(scene: HandScene, hands: HandLibrary) -> HandScene:
    """Return the scene, its camera moved into the middle of the palm."""
    keypoints_m = build_geometry(scene, hands).keypoints_m
    middle_m = keypoints_m[[0, 5, 9, 13, 17]].mean(axis=0)
    looked = scene.camera.world_to_camera.copy()
    looked[:3, 3] = -looked[:3, :3] @ middle_m
    return replace(scene, camera=Camera(scene.camera.intrinsics, looked))


def resized(scene: HandScene, side_px: int) -> HandScene:
    """Return the same view in pictures of another size."""
    lens = scene.camera.intrinsics
    scale = side_px / lens.width_px
    numbers = (scale * n for n in (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px))
    return replace(
        scene, camera=Camera(Intrinsics(*numbers, side_px, side_px), scene.camera.world_to_camera)
    )
