"""The pinhole, in float64: the one projection that labels, backgrounds and checks share."""

import numpy as np
import numpy.typing as npt

from services.worker.scene.types import Camera, Intrinsics

F8 = npt.NDArray[np.float64]

NEAR_M = 1e-3
"""Nearer than this to the camera's plane nothing is in the picture; the renderer clips there."""


def to_camera(camera: Camera, points_m: F8) -> F8:
    """Return (N, 3) world points in camera axes (x right, y down, z forward), metres."""
    rotation, translation = camera.world_to_camera[:3, :3], camera.world_to_camera[:3, 3]
    return points_m @ rotation.T + translation


def to_pixels(intrinsics: Intrinsics, camera_m: F8) -> F8:
    """Return the (N, 2) pixels of (N, 3) points in camera axes; NaN where z <= NEAR_M."""
    depth = camera_m[:, 2]
    safe = np.where(depth > NEAR_M, depth, np.nan)
    focal = np.array([intrinsics.fx_px, intrinsics.fy_px])
    centre = np.array([intrinsics.cx_px, intrinsics.cy_px])
    pixels: F8 = camera_m[:, :2] / safe[:, None] * focal + centre
    return pixels


def in_frame(intrinsics: Intrinsics, pixels: F8) -> npt.NDArray[np.bool_]:
    """Return (N,) whether pixels (N, 2) lie inside the picture; NaN does not."""
    x, y = pixels[:, 0], pixels[:, 1]
    inside: npt.NDArray[np.bool_] = (
        (x >= 0) & (x < intrinsics.width_px) & (y >= 0) & (y < intrinsics.height_px)
    )
    return inside
