"""The label of one image: everything a trainer, an auditor or a re-render needs, as JSON.

Image coordinates are continuous pixels: (0, 0) is the outer corner of the top-left pixel, whose
centre is (0.5, 0.5). Camera coordinates follow OpenCV: x right, y down, z forward, metres. World
coordinates are metres, z up. All geometry is computed in float64.
"""

from typing import Any

from pydantic import BaseModel, ConfigDict

from hi5_common.domain.vocabulary import Attribute, KeypointVisibility

Point2 = tuple[float, float]
Point3 = tuple[float, float, float]
Matrix3 = tuple[Point3, Point3, Point3]
Row4 = tuple[float, float, float, float]
Matrix4 = tuple[Row4, Row4, Row4, Row4]


class Frozen(BaseModel):
    """A value with known fields only."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Keypoint(Frozen):
    """One of the 21 points, in the middle of the finger. Out-of-frame pixels are kept.

    image_px is None only behind the camera, where no projection exists. occluder names the hand
    part that hides a self-occluded point; depth_margin_mm is how far in front of the point the
    first surface on its line of sight lies.
    """

    name: str
    image_px: Point2 | None
    camera_m: Point3
    world_m: Point3
    visibility: KeypointVisibility
    occluder: str | None
    depth_margin_mm: float | None


class Mask(Frozen):
    """COCO compressed run-length encoding (column-major counts); size is (height, width)."""

    size: tuple[int, int]
    counts: str
    area_px: int


class Box(Frozen):
    """Tight box in pixels: left, top, width, height."""

    x_px: float
    y_px: float
    width_px: float
    height_px: float


class CameraLabel(Frozen):
    """Pinhole camera: 3×3 intrinsics in pixels, 4×4 rigid world-to-camera extrinsics in metres."""

    intrinsics_px: Matrix3
    world_to_camera_m: Matrix4


class ImageLabel(Frozen):
    """The whole label of image `index`. A kind of label that was not asked for is None.

    split and twin_group say what the image belongs to, if the dataset has splits or twins: images
    of a twin_group show one scene. box and mask are of everything rendered, hand and forearm;
    hand_box and hand_mask end at the wrist. Boxes are of the surface, hidden or not; masks of what
    shows. affect is what the pose implies (`affect.py`). attributes hold what the image was asked
    to be: of a shape factor the band that its number under `scene` was drawn from.
    """

    index: int
    split: str | None = None
    twin_group: int | None = None
    file_name: str
    width_px: int
    height_px: int
    attributes: dict[Attribute, str]
    affect: str
    camera: CameraLabel
    keypoints: tuple[Keypoint, ...] | None
    box: Box | None
    hand_box: Box | None
    mask: Mask | None
    hand_mask: Mask | None
    in_frame_share: float
    scene: dict[str, Any]
    """The resolved scene: pose pair and t, joint angles, light, skin, render settings, versions."""
