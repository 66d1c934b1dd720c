"""A hand scene, fully resolved: what a renderer and a labeller need, and nothing else.

Everything is plain data that can be printed, hashed and saved as JSON; geometry is float64.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hi5_common.domain.plan import Cell
from hi5_common.domain.vocabulary import Pose
from services.worker.hand.angles import JointAngles
from services.worker.hand.shape import HandShape
from services.worker.hand.skinmaps.planes import Plane
from services.worker.ornaments.mesh import OrnamentMesh
from services.worker.ornaments.worn import BARE, Worn
from services.worker.scene.camera_look import PLAIN_LOOK, CameraLook

Array = npt.NDArray[np.float64]
Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Intrinsics:
    """Pinhole camera in pixels; (0, 0) is the outer corner of the top-left pixel."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int

    def matrix(self) -> Array:
        """Return the (3, 3) calibration matrix."""
        return np.array([[self.fx_px, 0, self.cx_px], [0, self.fy_px, self.cy_px], [0, 0, 1.0]])


@dataclass(frozen=True, eq=False)
class Camera:
    """Intrinsics and the rigid (4, 4) world-to-camera transform, metres, OpenCV axes."""

    intrinsics: Intrinsics
    world_to_camera: Array


@dataclass(frozen=True)
class PoseBlend:
    """A pose on the way from one library pose to another: t = 0 is `source`, t = 1 `target`."""

    source: Pose
    target: Pose
    t: float


@dataclass(frozen=True)
class Light:
    """An environment panorama turned about the vertical, with the exposure of the picture.

    A world direction d looks up the panorama at longitude atan2(d.y, d.x) - rotation_z_deg in
    Blender's equirectangular layout. The linear radiance is multiplied by `gain` before the sRGB
    curve: 2**exposure_ev, and in each channel what the camera balances white by.
    """

    environment: str
    rotation_z_deg: float
    exposure_ev: float
    white_balance: Rgb = (1.0, 1.0, 1.0)

    @property
    def gain(self) -> npt.NDArray[np.float32]:
        """Return what radiance is multiplied by, (3,): red, green, blue."""
        return np.float32(2.0**self.exposure_ev) * np.array(self.white_balance, dtype=np.float32)


type Mix = tuple[tuple[Plane, float], ...]
"""Planes of the skin maps, each with a weight."""


@dataclass(frozen=True)
class Layer:
    """One filter over the skin: a unit of its mix adds `rgb` to the logarithm of the albedo."""

    rgb: Rgb
    mix: Mix


@dataclass(frozen=True)
class Pigment:
    """Albedo = base x exp(sum of layers): pigments are filters, one over another."""

    layers: tuple[Layer, ...]


@dataclass(frozen=True)
class Relief:
    """Heights over the mesh in millimetres: what stays, and folds that a bent joint pulls flat."""

    still: Mix
    slack: Mix


@dataclass(frozen=True)
class NailPolish:
    """Paint on the nails: linear sRGB albedo and roughness of its gloss; clear paint has none."""

    rgb: Rgb | None
    roughness: float


@dataclass(frozen=True)
class Skin:
    """Diffuse albedos in linear sRGB (Rec. 709, D65), transport mean free path in mm, roughness.

    dorsum_rgb is the area-weighted mean over the back of the hand, all maps included.
    """

    ita_deg: float
    age_years: float
    dorsum_rgb: Rgb
    palm_rgb: Rgb
    nail_rgb: Rgb
    pigment: Pigment
    relief: Relief
    mean_free_path_mm: Rgb
    roughness: float
    nail_polish: NailPolish | None
    nail_edge_from: float
    """Where the nails' free edge begins, on the way from their root (-1) to their tip (1)."""

    lunula: float
    """How clear the half moons are, 0..1."""


@dataclass(frozen=True)
class Stance:
    """How the forearm stands in the world: elevation above the horizon, turn about the vertical.

    The hand's owner looks along +y with +x to the right; azimuth 0 points the forearm along +y.
    """

    elevation_deg: float
    azimuth_deg: float


@dataclass(frozen=True)
class PolarView:
    """The camera around the hand's middle: where it stands and how it is turned from looking there.

    Azimuth is measured from the world's +y towards +x, elevation above the horizon. Pitch, yaw
    and roll are rotations about the camera's own x, y and z axes after it was aimed at the hand.
    """

    azimuth_deg: float
    elevation_deg: float
    distance_m: float
    pitch_deg: float
    yaw_deg: float
    roll_deg: float


@dataclass(frozen=True, eq=False)
class HandScene:
    """One image's scene. `view_attempt` counts the views that were rejected before this one.

    draw: which draw of its cell it is; 0 but for images that replace one that could not be made.
    split, twin_group: what the image belongs to, if its dataset has splits or twins.

    phase is the moment (0..1 of a period) of a pose that is a motion, None for one that is not.
    hand_to_world (4, 4) takes the posed hand's elbow frame to the world, metres.
    """

    index: int
    cell: Cell
    shape: HandShape
    blend: PoseBlend
    phase: float | None
    angles: JointAngles
    stance: Stance
    view: PolarView
    hand_to_world: Array
    camera: Camera
    light: Light
    skin: Skin
    view_attempt: int
    render_seed: int
    worn: Worn = BARE
    look: CameraLook = PLAIN_LOOK
    draw: int = 0
    split: str | None = None
    twin_group: int | None = None


@dataclass(frozen=True, eq=False)
class SceneGeometry:
    """The posed, subdivided hand in world metres: exactly the surface that is rendered.

    vertices_m (W, 3) f8; quads (G, 4) i4, outward; uvs (G, 4, 2) f4; nail, palm, slack (W,) f8 in
    0..1 (slack: how much the skin lies in folds over its joint);
    part (W,) i4 index into HandPart; keypoints_m (21, 3) f8.
    """

    vertices_m: Array
    quads: npt.NDArray[np.int32]
    uvs: npt.NDArray[np.float32]
    nail: Array
    palm: Array
    slack: Array
    part: npt.NDArray[np.int32]
    keypoints_m: Array
    ornaments: tuple[OrnamentMesh, ...] = ()
