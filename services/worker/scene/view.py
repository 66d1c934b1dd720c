"""Where the camera stands: polar coordinates around the hand, and whether a view will do."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from hi5_common.domain.spec import ImageRequest
from hi5_common.domain.vocabulary import Viewpoint
from services.worker.hand.skin import PosedHand
from services.worker.ornaments.mesh import OrnamentMesh, OrnamentName
from services.worker.scene.geometry import transformed
from services.worker.scene.library import Hand
from services.worker.scene.types import Array, Camera, Intrinsics, PolarView, Stance

MAX_OUT_OF_FRAME = 0.25
AREA_MARGIN = 0.015
"""The control mesh judges views; the label measures the subdivided skin, a little differently."""
MIN_DISTANCE_M = 0.08
ALONG_FOREARM_DEG = 40.0
INTO_FINGERTIPS_DEG = 20.0
WIDEST_FIELD_DEG = 65.0
"""Over the shorter side: a telephone's lens. Narrower: a longer one, or a part of a picture."""
HAND_SHARE_OF_FRAME = (0.5, 1.2)
SLEEVED_SHARE_OF_FRAME = (0.2, 1.2)
"""A sleeve hides where the forearm was cut off, so the camera may stand further away."""
CUT_LENGTH_M = 0.02


@dataclass(frozen=True)
class ViewRange:
    """Azimuths (either of the centres, give or take `spread_deg`), elevations and distances of a
    viewpoint.
    """

    centres_deg: tuple[float, ...]
    spread_deg: float
    elevation_deg: tuple[float, float]
    distance_m: tuple[float, float]


# A bystander stands beside or at an angle: who talks with somebody is seldom watched along the
# edge of the hand. One's own hand is no farther than one's arm is long; nearer than a quarter of a
# metre only few photographs are taken, and a hand is all thumb there.
VIEW_RANGES = {
    Viewpoint.FIRST_PERSON: ViewRange((180.0,), 30.0, (10.0, 55.0), (0.22, 0.6)),
    Viewpoint.SECOND_PERSON: ViewRange((0.0,), 50.0, (-10.0, 35.0), (0.25, 0.9)),
    Viewpoint.THIRD_PERSON: ViewRange((-70.0, 70.0), 35.0, (-20.0, 45.0), (0.25, 0.9)),
}


def draw_stance(rng: np.random.Generator) -> Stance:
    """Draw how the forearm stands: from reaching forward to upright."""
    return Stance(float(rng.uniform(20.0, 90.0)), float(rng.uniform(-25.0, 25.0)))


def draw_lens(
    viewpoint: Viewpoint,
    image: ImageRequest,
    radius_m: float,
    shares: tuple[float, float],
    rng: np.random.Generator,
) -> tuple[Intrinsics, float]:
    """Draw from how far (metres) and with which lens a hand of this radius fills a drawn share of
    the frame's shorter side; square pixels, centred principal point.

    The lens follows from distance and share; where it would be wider than WIDEST_FIELD_DEG the
    camera steps back.
    """
    distance_m = _log_uniform(rng, VIEW_RANGES[viewpoint].distance_m)
    share = _log_uniform(rng, shares)
    side_px = min(image.width, image.height)
    widest_px = side_px / 2.0 / math.tan(math.radians(WIDEST_FIELD_DEG) / 2.0)
    focal_px = max(share * side_px * distance_m / (2.0 * radius_m), widest_px)
    centre = (image.width / 2.0, image.height / 2.0)
    lens = Intrinsics(focal_px, focal_px, *centre, image.width, image.height)
    return lens, 2.0 * radius_m * focal_px / (share * side_px)


def draw_view(
    viewpoint: Viewpoint,
    lens: Intrinsics,
    radius_m: float,
    distance_m: float,
    rng: np.random.Generator,
) -> PolarView:
    """Draw where around a hand of this radius the camera stands, and how it is turned from it: as
    far as the hand stays in the frame, or nearly.
    """
    ranges = VIEW_RANGES[viewpoint]
    centre = ranges.centres_deg[int(rng.integers(len(ranges.centres_deg)))]
    side_px = min(lens.width_px, lens.height_px)
    share = 2.0 * radius_m * lens.fx_px / (distance_m * side_px)
    field_deg = 2.0 * math.degrees(math.atan(side_px / 2.0 / lens.fx_px))
    slack_deg = field_deg * max(0.5 * (1.0 - share), 0.0) + field_deg * MAX_OUT_OF_FRAME * share
    return PolarView(
        azimuth_deg=centre + float(rng.uniform(-ranges.spread_deg, ranges.spread_deg)),
        elevation_deg=float(rng.uniform(*ranges.elevation_deg)),
        distance_m=distance_m,
        pitch_deg=float(rng.triangular(-slack_deg, 0.0, slack_deg)),
        yaw_deg=float(rng.triangular(-slack_deg, 0.0, slack_deg)),
        roll_deg=float(np.clip(rng.normal(0.0, 10.0), -30.0, 30.0)),
    )


def polar_direction(azimuth_deg: float, elevation_deg: float) -> Array:
    """Return the unit vector (3,): azimuth from +y towards +x, elevation above the horizon."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    level = math.cos(elevation)
    return np.array([level * math.sin(azimuth), level * math.cos(azimuth), math.sin(elevation)])


def camera_at(view: PolarView, target_m: Array, lens: Intrinsics) -> Camera:
    """Stand a camera at a polar view of a target (3,), aim it there, then turn it."""
    outward = polar_direction(view.azimuth_deg, view.elevation_deg)
    forward = -outward
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    aimed = np.stack([right, np.cross(forward, right), forward])
    turned = _rotation_xyz(view.pitch_deg, view.yaw_deg, view.roll_deg) @ aimed
    world_to_camera = np.eye(4)
    world_to_camera[:3, :3] = turned
    world_to_camera[:3, 3] = -turned @ (target_m + view.distance_m * outward)
    return Camera(lens, world_to_camera)


@dataclass(frozen=True, eq=False)
class ViewedHand:
    """What a view is judged by: skin of the hand and of the forearm that shows, the sleeve, the end
    where the forearm was cut off or the sleeve was, and the keypoints, (N, 3) each, metres; and the
    skin area that each point of the hand has.
    """

    hand_m: Array
    areas_m2: Array
    arm_m: Array
    sleeve_m: Array
    cut_m: Array
    keypoints_m: Array

    @classmethod
    def of(cls, hand: Hand, posed: PosedHand, worn: tuple[OrnamentMesh, ...] = ()) -> Self:
        """Sort the skin of a hand posed in its elbow frame, whose forearm lies along -y."""
        is_forearm = hand.model.forearm
        arm_m = posed.vertices_m[is_forearm]
        sleeves = [mesh.vertices_m for mesh in worn if mesh.name is OrnamentName.SLEEVE]
        sleeve_m = np.concatenate([np.empty((0, 3)), *sleeves])
        covered = sleeve_m if len(sleeve_m) else arm_m
        return cls(
            hand_m=posed.vertices_m[~is_forearm],
            areas_m2=hand.areas_m2[~is_forearm],
            arm_m=arm_m[arm_m[:, 1] > sleeve_m[:, 1].max(initial=-np.inf)],
            sleeve_m=sleeve_m,
            cut_m=covered[covered[:, 1] < covered[:, 1].min() + CUT_LENGTH_M],
            keypoints_m=posed.keypoints_m,
        )

    def placed(self, matrix: Array) -> Self:
        """Return the same hand moved by a (4, 4) transform."""
        names = ("hand_m", "arm_m", "sleeve_m", "cut_m", "keypoints_m")
        return replace(self, **{name: transformed(matrix, getattr(self, name)) for name in names})

    @property
    def shares(self) -> tuple[float, float]:
        """Return how little and how much of the frame the hand may fill."""
        return SLEEVED_SHARE_OF_FRAME if len(self.sleeve_m) else HAND_SHARE_OF_FRAME

    def in_frame_share(self, camera: Camera) -> float:
        """Return how much of the hand is in the frame: the lesser of its skin and its keypoints."""
        skin = float(self.areas_m2[in_frame(camera, self.hand_m)].sum() / self.areas_m2.sum())
        return min(skin, float(in_frame(camera, self.keypoints_m).mean()))


def view_will_do(camera: Camera, hand: ViewedHand, stance: Stance) -> bool:
    """Tell whether a view shows the hand: near enough whole, not end on, camera outside it, and
    the forearm or the sleeve running out of the picture instead of ending in it. A sleeve may go
    past the camera.
    """
    skin_m = np.concatenate([hand.hand_m, hand.arm_m])
    if transformed(camera.world_to_camera, skin_m)[:, 2].min() < 0:
        return False
    if hand.in_frame_share(camera) < 1.0 - MAX_OUT_OF_FRAME + AREA_MARGIN:
        return False
    if in_frame(camera, hand.cut_m).any():
        return False
    everything_m = np.concatenate([skin_m, hand.sleeve_m])
    distances_m = np.linalg.norm(everything_m - camera_position(camera), axis=1)
    return bool(distances_m.min() >= MIN_DISTANCE_M) and not _end_on(camera, hand.hand_m, stance)


def in_frame(camera: Camera, points_m: Array) -> npt.NDArray[np.bool_]:
    """Tell which points (N, 3) lie in front of the camera and inside the frame: (N,)."""
    lens = camera.intrinsics
    in_camera = transformed(camera.world_to_camera, points_m)
    ahead = in_camera[:, 2] > 0
    depth = np.where(ahead, in_camera[:, 2], 1.0)
    x = lens.fx_px * in_camera[:, 0] / depth + lens.cx_px
    y = lens.fy_px * in_camera[:, 1] / depth + lens.cy_px
    inside: npt.NDArray[np.bool_] = (
        ahead & (x >= 0) & (x < lens.width_px) & (y >= 0) & (y < lens.height_px)
    )
    return inside


def _end_on(camera: Camera, hand_m: Array, stance: Stance) -> bool:
    towards = camera_position(camera) - hand_m.mean(axis=0)
    forearm = polar_direction(stance.azimuth_deg, stance.elevation_deg)
    cosine = float(towards @ forearm / np.linalg.norm(towards))
    angle_deg = math.degrees(math.acos(np.clip(cosine, -1.0, 1.0)))
    return angle_deg < INTO_FINGERTIPS_DEG or angle_deg > 180.0 - ALONG_FOREARM_DEG


def camera_position(camera: Camera) -> Array:
    """Return where the camera stands in the world, (3,) metres."""
    rotation = camera.world_to_camera[:3, :3]
    position: Array = -rotation.T @ camera.world_to_camera[:3, 3]
    return position


def _rotation_xyz(x_deg: float, y_deg: float, z_deg: float) -> Array:
    """Return the (3, 3) rotation about x, then y, then z."""
    (cx, sx), (cy, sy), (cz, sz) = (
        (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
        for angle in (x_deg, y_deg, z_deg)
    )
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1.0]])
    rotation: Array = about_z @ about_y @ about_x
    return rotation


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    return math.exp(float(rng.uniform(*np.log(limits))))
