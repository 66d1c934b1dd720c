"""The label of one image, from the scene and the projected mesh; the picture is never consulted."""

from typing import Any

import numpy as np
import numpy.typing as npt

from hi5_common.domain.affect import POSE_AFFECT
from hi5_common.domain.labels import (
    CameraLabel,
    ImageLabel,
    Keypoint,
    Mask,
    Matrix3,
    Matrix4,
    Point2,
    Point3,
)
from hi5_common.domain.spec import LabelKind
from hi5_common.domain.vocabulary import KEYPOINTS
from services.worker.label.box import tight_box
from services.worker.label.mask import encode_mask
from services.worker.label.occluders import FOREARM, is_hand, occluder_of
from services.worker.label.projected import ProjectedMesh
from services.worker.label.projection import F8, in_frame, to_camera, to_pixels
from services.worker.label.raster import Surface
from services.worker.label.visibility import Sight, sight_keypoints
from services.worker.scene.types import Camera, HandScene, SceneGeometry

SHARE_DECIMALS = 9
"""Of in_frame_share: coarser than what processes disagree about in a sum of thousands of areas."""


def label_image(
    scene: HandScene,
    geometry: SceneGeometry,
    surface: Surface,
    kinds: frozenset[LabelKind],
    *,
    file_name: str,
    resolved: dict[str, Any],
) -> ImageLabel:
    """Return the label; kinds that were not asked for are None. resolved: see provenance.py."""
    mesh = surface.mesh
    of_hand = is_hand(occluder_of(geometry))
    boxed = LabelKind.BOX in kinds
    masks = _masks(surface, of_hand) if LabelKind.MASK in kinds else (None, None)
    return ImageLabel(
        index=scene.index,
        split=scene.split,
        twin_group=scene.twin_group,
        file_name=file_name,
        width_px=scene.camera.intrinsics.width_px,
        height_px=scene.camera.intrinsics.height_px,
        attributes=scene.cell.as_dict(),
        affect=POSE_AFFECT[scene.cell.pose],
        camera=camera_label(scene.camera),
        keypoints=_keypoints(scene, geometry, mesh) if LabelKind.KEYPOINTS in kinds else None,
        box=tight_box(mesh, np.ones_like(of_hand)) if boxed else None,
        hand_box=tight_box(mesh, of_hand) if boxed else None,
        mask=masks[0],
        hand_mask=masks[1],
        in_frame_share=in_frame_share(scene.camera, geometry),
        scene=resolved,
    )


def camera_label(camera: Camera) -> CameraLabel:
    """Return the camera as its two matrices."""
    return CameraLabel(
        intrinsics_px=_matrix3(camera.intrinsics.matrix()),
        world_to_camera_m=_matrix4(camera.world_to_camera),
    )


def in_frame_share(camera: Camera, geometry: SceneGeometry) -> float:
    """Return the share of the hand's skin area, without the forearm, that lies in the frame.

    Hidden skin counts too. Each quad counts with its area, in the frame if its middle is.
    """
    quads = geometry.quads[(geometry.part[geometry.quads] != FOREARM).all(axis=1)]
    corners = geometry.vertices_m[quads]
    diagonals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area_m2 = np.linalg.norm(diagonals, axis=1) / 2.0
    pixels = to_pixels(camera.intrinsics, to_camera(camera, corners.mean(axis=1)))
    inside = in_frame(camera.intrinsics, pixels)
    return round(float(area_m2[inside].sum() / area_m2.sum()), SHARE_DECIMALS)


def _masks(surface: Surface, of_hand: npt.NDArray[np.bool_]) -> tuple[Mask, Mask]:
    """Return the masks of pixels whose centres see anything rendered, and skin of the hand.

    of_hand (N,) by vertex. An ornament is in the first, and out of the second where it hides skin;
    nail polish is skin. A triangle across the wrist is the forearm's, as it is for the boxes. The
    masks are taken from the exact surface and not from the path tracer's alpha, so that they do not
    change with samples, denoiser or machine; tests hold the two together.
    """
    hand_triangles = of_hand[surface.mesh.triangles].all(axis=1)
    hand = surface.covered & hand_triangles[surface.triangle]
    return encode_mask(surface.covered), encode_mask(hand)


def _keypoints(
    scene: HandScene, geometry: SceneGeometry, mesh: ProjectedMesh
) -> tuple[Keypoint, ...]:
    camera_m = to_camera(scene.camera, geometry.keypoints_m)
    pixels = to_pixels(scene.camera.intrinsics, camera_m)
    sights = sight_keypoints(mesh, occluder_of(geometry), camera_m, pixels)
    rows = zip(KEYPOINTS, pixels, camera_m, geometry.keypoints_m, sights, strict=True)
    return tuple(_keypoint(*row) for row in rows)


def _keypoint(name: str, pixel: F8, camera_m: F8, world_m: F8, sight: Sight) -> Keypoint:
    return Keypoint(
        name=name,
        image_px=None if np.isnan(pixel[0]) else _point2(pixel),
        camera_m=_point3(camera_m),
        world_m=_point3(world_m),
        visibility=sight.visibility,
        occluder=sight.occluder,
        depth_margin_mm=sight.depth_margin_mm,
    )


def _point2(values: npt.NDArray[np.float64]) -> Point2:
    x, y = values.tolist()
    return x, y


def _point3(values: npt.NDArray[np.float64]) -> Point3:
    x, y, z = values.tolist()
    return x, y, z


def _matrix3(values: npt.NDArray[np.float64]) -> Matrix3:
    a, b, c = (_point3(row) for row in values)
    return a, b, c


def _matrix4(values: npt.NDArray[np.float64]) -> Matrix4:
    a, b, c, d = (tuple(row.tolist()) for row in values)
    return a, b, c, d
