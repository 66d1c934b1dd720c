"""A label is proved by pixels: emissive markers at the joints, and only there."""

import bpy
import numpy as np
import pytest

from hi5_common.domain.vocabulary import KEYPOINTS, Handedness
from services.worker.label.projection import F8, in_frame, to_camera, to_pixels
from services.worker.render.blender import camera, film, session
from services.worker.render.rect import PixelRect
from services.worker.scene.library import HandLibrary
from services.worker.scene.types import Camera, Intrinsics
from tests.render.scenes import CENTRED, NOISY, OFF_CENTRE, sampled, take

pytestmark = pytest.mark.render

RADIUS_PX = 3.0
TOLERANCE_PX = 0.5


class MarkerStudio:
    """Our Blender session and camera, with one glowing ball instead of the hand."""

    def __init__(self) -> None:
        self.scene = session.open_session(2, persistent_data=True).scene
        camera.new_camera(self.scene)
        self.film = film.MemoryFile()
        bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, segments=32, ring_count=16)
        self.ball = bpy.context.object
        self.ball.data.materials.append(_glow())

    def centroid_px(self, view: Camera, region: PixelRect, point_m: F8, depth_m: float) -> F8:
        """Return the centre of the ball's light in the whole picture's pixels."""
        lens = view.intrinsics
        radius_m = RADIUS_PX * depth_m / max(lens.fx_px, lens.fy_px)
        self.ball.location, self.ball.scale = point_m.tolist(), (radius_m,) * 3
        camera.aim(self.scene, view, region)
        session.apply_settings(self.scene, NOISY, 0)
        light = film.shoot(self.scene, self.film)[..., 0].astype(np.float64)
        rows, columns = np.indices(light.shape) + 0.5
        centre = np.array([(light * columns).sum(), (light * rows).sum()]) / light.sum()
        corner = np.array([region.left, region.top], dtype=np.float64)
        whole: F8 = centre + corner
        return whole


def _glow() -> bpy.types.Material:
    material = bpy.data.materials.new("glow")
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material


@pytest.fixture(scope="module")
def markers() -> MarkerStudio:
    return MarkerStudio()


@pytest.mark.parametrize("lens", [CENTRED, OFF_CENTRE], ids=["centred", "off-centre"])
@pytest.mark.parametrize("hand", Handedness)
def test_a_marker_at_each_joint_is_seen_where_the_label_says(
    markers: MarkerStudio, hands: HandLibrary, hand: Handedness, lens: Intrinsics
) -> None:
    shot = take(hands, lens, hand=hand)
    points_m = shot.geometry.keypoints_m
    camera_m = to_camera(shot.scene.camera, points_m)
    labels_px = to_pixels(lens, camera_m)
    assert in_frame(lens, labels_px).all()
    assert (np.ptp(labels_px, axis=0) > 20.0).all()
    for name, point_m, seen_m, label_px in zip(
        KEYPOINTS, points_m, camera_m, labels_px, strict=True
    ):
        depth_m = float(seen_m[2])
        seen_px = markers.centroid_px(shot.scene.camera, shot.whole_frame, point_m, depth_m)
        assert np.linalg.norm(seen_px - label_px) < TOLERANCE_PX, (name, seen_px, label_px)


def _whole_ball_in(region: PixelRect, pixel: F8) -> bool:
    inner = region.grown(-int(RADIUS_PX + 3))
    return bool(inner.left <= pixel[0] < inner.right and inner.top <= pixel[1] < inner.bottom)


@pytest.mark.parametrize("index", range(4))
def test_in_a_sampled_scene_markers_are_seen_where_the_whole_label_says(
    markers: MarkerStudio, hands: HandLibrary, index: int
) -> None:
    """As the fleet does it: the scene's own camera, cut to the rectangle that the hand touches."""
    shot = sampled(hands, index)
    label = shot.label()
    assert label.keypoints
    checked = 0
    for point in label.keypoints:
        label_px = np.array(point.image_px)
        if not _whole_ball_in(shot.region, label_px):
            continue
        point_m, depth_m = np.array(point.world_m), point.camera_m[2]
        seen_px = markers.centroid_px(shot.scene.camera, shot.region, point_m, depth_m)
        assert np.linalg.norm(seen_px - label_px) < TOLERANCE_PX, (point, seen_px)
        checked += 1
    assert checked >= 10
