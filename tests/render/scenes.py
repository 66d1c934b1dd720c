"""Small, fully resolved scenes of real hands, with cameras of our choosing."""

from dataclasses import dataclass, replace

import numpy as np

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import LabelKind, parse_spec
from hi5_common.domain.vocabulary import Gender, Handedness, Pose, SkinTone
from services.worker.label.label import label_image
from services.worker.label.projected import ProjectedMesh, project_mesh
from services.worker.label.projection import F8
from services.worker.label.raster import rasterise
from services.worker.label.region import touched_region
from services.worker.render.rect import PixelRect
from services.worker.render.settings import Denoise, Prefilter, RenderSettings
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import Camera, HandScene, Intrinsics, SceneGeometry

CENTRED = Intrinsics(110.0, 110.0, 48.0, 48.0, 96, 96)
OFF_CENTRE = Intrinsics(120.0, 150.0, 131.5, -20.25, 88, 104)
"""Cut out of a larger picture: the principal point lies outside, pixels are not square."""

NOISY = RenderSettings(4, Denoise.NONE, Prefilter.NONE)
DENOISED = RenderSettings(2, Denoise.FAST, Prefilter.FAST)


@dataclass(frozen=True, eq=False)
class Shot:
    """A scene with its geometry."""

    scene: HandScene
    geometry: SceneGeometry

    @property
    def mesh(self) -> ProjectedMesh:
        return project_mesh(self.scene.camera, self.geometry)

    @property
    def region(self) -> PixelRect:
        return touched_region(self.mesh)

    def label(self) -> ImageLabel:
        """Return the label with every kind in it."""
        kinds = frozenset(LabelKind)
        return label_image(
            self.scene,
            self.geometry,
            rasterise(self.mesh),
            kinds,
            file_name="0.png",
            resolved={},
        )

    @property
    def whole_frame(self) -> PixelRect:
        lens = self.scene.camera.intrinsics
        return PixelRect(0, 0, lens.width_px, lens.height_px)


SAMPLED = {"count": 120, "seed": 77001, "image": {"width": 240, "height": 180}}


def sampled(hands: HandLibrary, index: int) -> Shot:
    """Return a scene as the fleet samples it, camera and all."""
    spec = parse_spec(SAMPLED)
    scene = sample_scene(spec, Plan.of(spec), index, hands)
    return Shot(scene, build_geometry(scene, hands))


def take(
    hands: HandLibrary,
    lens: Intrinsics = CENTRED,
    *,
    hand: Handedness = Handedness.RIGHT,
    pose: Pose = Pose.FIVE,
    tone: SkinTone = SkinTone.TAN,
    environment: str = "city",
    seed: int = 1,
) -> Shot:
    """Return a hand whose middle lies in the middle of the lens's picture, 0.45 m away."""
    wanted = {
        "gender": [Gender.FEMALE],
        "handedness": [hand],
        "pose": [pose],
        "skin_tone": [tone],
        "environment": [environment],
    }
    spec = parse_spec({"count": 1, "seed": seed, "attributes": wanted})
    scene = sample_scene(spec, Plan.of(spec), 0, hands)
    geometry = build_geometry(scene, hands)
    camera = facing(lens, geometry.keypoints_m.mean(axis=0), 0.45)
    return Shot(replace(scene, camera=camera), geometry)


def facing(lens: Intrinsics, target_m: F8, distance_m: float) -> Camera:
    """Return a camera that sees `target_m` (3,) at the middle pixel of its picture."""
    middle = [
        (lens.width_px / 2.0 - lens.cx_px) / lens.fx_px,
        (lens.height_px / 2.0 - lens.cy_px) / lens.fy_px,
        1.0,
    ]
    ray = np.array(middle) / np.linalg.norm(middle)
    rotation = _turning(np.array([0.6, 0.7, -0.4]), np.array([0.0, 0.0, -1.0]), ray)
    world_to_camera = np.eye(4)
    world_to_camera[:3, :3] = rotation
    world_to_camera[:3, 3] = distance_m * ray - rotation @ target_m
    return Camera(lens, world_to_camera)


def _turning(forward: F8, down: F8, ray: F8) -> F8:
    """Return the rotation that takes `forward` to `ray` and `down` towards camera y."""
    world, camera = _frame(forward, down), _frame(ray, np.array([0.0, 1.0, 0.0]))
    rotation: F8 = camera.T @ world
    return rotation


def _frame(z: F8, y: F8) -> F8:
    third = z / np.linalg.norm(z)
    first = np.cross(y, third)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third])
