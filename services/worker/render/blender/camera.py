"""A pinhole with any principal point, cut to a rectangle of its pixels."""

from dataclasses import dataclass

import bpy
import mathutils
import numpy as np

from services.worker.render.rect import PixelRect
from services.worker.scene.types import Camera, Intrinsics

CLIP_START_M, CLIP_END_M = 0.001, 100.0
MIN_LENS_MM, MAX_LENS_MM = 1.0, 5000.0

BLENDER_FROM_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenCV cameras look along +z with y down, Blender's along -z with y up."""


@dataclass(frozen=True)
class Lens:
    """Blender's words for a pinhole seen through a rectangle.

    Shifts are fractions of the rectangle's width, to the right and up; pixels are `aspect_x` wide
    and `aspect_y` high.
    """

    lens_mm: float
    sensor_mm: float
    shift_x: float
    shift_y: float
    aspect_x: float
    aspect_y: float


def lens_for(intrinsics: Intrinsics, region: PixelRect) -> Lens:
    """Return the lens whose full frame is exactly `region` of the pinhole's picture.

    With a horizontal sensor fit fx_px = lens / sensor × width and fy_px = fx_px × aspect_x /
    aspect_y; a shift moves the picture by that share of the width, in square units.
    """
    ratio = intrinsics.fx_px / region.width
    sensor_mm = MIN_LENS_MM / ratio if ratio < MIN_LENS_MM else 1.0
    pixel_height = intrinsics.fx_px / intrinsics.fy_px
    left_px, top_px = region.left + region.width / 2, region.top + region.height / 2
    return Lens(
        lens_mm=min(ratio * sensor_mm, MAX_LENS_MM),
        sensor_mm=sensor_mm,
        shift_x=(left_px - intrinsics.cx_px) / region.width,
        shift_y=(intrinsics.cy_px - top_px) * pixel_height / region.width,
        aspect_x=max(1.0, 1.0 / pixel_height),
        aspect_y=max(1.0, pixel_height),
    )


def new_camera(scene: bpy.types.Scene) -> bpy.types.Object:
    """Add a perspective camera without depth of field and make it the scene's."""
    data = bpy.data.cameras.new("camera")
    data.type = "PERSP"
    data.sensor_fit = "HORIZONTAL"
    data.clip_start, data.clip_end = CLIP_START_M, CLIP_END_M
    data.dof.use_dof = False
    camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def aim(scene: bpy.types.Scene, camera: Camera, region: PixelRect) -> None:
    """Point the scene's camera so that a render gives `region` of the camera's picture."""
    lens = lens_for(camera.intrinsics, region)
    scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = lens.aspect_x, lens.aspect_y
    data = scene.camera.data
    data.sensor_width, data.lens = lens.sensor_mm, lens.lens_mm
    data.shift_x, data.shift_y = lens.shift_x, lens.shift_y
    camera_to_world = np.linalg.inv(camera.world_to_camera) @ BLENDER_FROM_OPENCV
    scene.camera.matrix_world = mathutils.Matrix(camera_to_world.tolist())
