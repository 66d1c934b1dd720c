"""Hands that nobody drew by chance: an asked-for hand, held up before a chosen camera and light."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute, Gender, Pose, Viewpoint
from services.worker.hand.bones import BONE_INDEX
from services.worker.hand.skin import posed_hand
from services.worker.scene.exposure import Seen, colour_on_hand, light_on_hand, metered_light
from services.worker.scene.geometry import transformed
from services.worker.scene.library import HandLibrary
from services.worker.scene.poses import solved_angles
from services.worker.scene.sampling import WHITE_LEVEL, hand_to_world, sample_scene
from services.worker.scene.types import (
    Array,
    Camera,
    HandScene,
    Intrinsics,
    Light,
    PoseBlend,
    Stance,
)
from services.worker.scene.white_balance import white_balance_of

UPRIGHT = Stance(90.0, 0.0)
MARGIN = 1.12
"""The picture is this much larger than what is looked at."""
SIDE_DEG = 30.0
"""Light from the camera models no form."""
ADAPTED = 0.75
"""Share of the light's cast that the camera takes out: the middle of what it draws elsewhere."""


@dataclass(frozen=True)
class Aim:
    """Where the camera stands, seen from the hand, and what fills the picture.

    turn_deg goes about the forearm from the back of the hand (0) by way of the thumb (90) to the
    palm (180); rise_deg towards the fingertips. keypoints: what must be in the picture (None: the
    whole hand), with reach_m of flesh around each.
    """

    turn_deg: float
    rise_deg: float = 5.0
    keypoints: tuple[int, ...] | None = None
    reach_m: float = 0.016
    margin: float = MARGIN
    span_m: float | None = None
    """How much the picture is wide at the hand; None: as what is looked at needs."""

    distance_m: float = 0.55
    arm_m: float = 0.0
    """How much of the forearm is to be in the picture, if the whole hand is."""


DEFAULT_ATTRIBUTES: Mapping[Attribute, str] = {
    Attribute.GENDER: Gender.FEMALE,
    Attribute.SKIN_TONE: "intermediate",
    Attribute.POSE: Pose.NEUTRAL_RELAXED,
    Attribute.ENVIRONMENT: "studio_grey",
    Attribute.HANDEDNESS: "right",
    Attribute.VIEWPOINT: Viewpoint.THIRD_PERSON,
    Attribute.AGE: "35",
    Attribute.WEIGHT: "0.5",
    Attribute.MUSCLE: "0.5",
    Attribute.FINGER_LENGTH: "0",
    Attribute.FINGER_THICKNESS: "0",
    Attribute.HAND_SCALE: "0",
}


@dataclass(frozen=True)
class Sitting:
    """One picture of the gallery: what differs from the default hand, and how it is looked at."""

    title: str
    attributes: Mapping[Attribute, str]
    aim: Aim
    seed: int = 1
    side_px: int = 320
    in_place: bool = False
    """Whether the environment shows behind the hand, as in a dataset, or plain grey."""


def scene_of(sitting: Sitting, hands: HandLibrary) -> HandScene:
    """Resolve a sitting: exactly the library's pose, upright before the camera, evenly lit."""
    asked = {**DEFAULT_ATTRIBUTES, **sitting.attributes}
    side_px = sitting.side_px
    spec = parse_spec(
        {
            "count": 1,
            "seed": sitting.seed,
            "image": {"width": side_px, "height": side_px},
            "attributes": {name.value: [str(value)] for name, value in asked.items()},
        }
    )
    drawn = sample_scene(spec, Plan.of(spec), 0, hands)
    blend = PoseBlend(drawn.cell.pose, drawn.cell.pose, 0.0)
    placed = hand_to_world(UPRIGHT, drawn.cell)
    posed_scene = replace(
        drawn,
        blend=blend,
        phase=None,
        angles=solved_angles(drawn.cell.gender, drawn.cell.pose, drawn.shape),
        stance=UPRIGHT,
        hand_to_world=placed,
    )
    return _photographed(posed_scene, sitting.aim, hands)


def _photographed(scene: HandScene, aim: Aim, hands: HandLibrary) -> HandScene:
    hand = hands.hand(scene.cell.gender, scene.cell.handedness, scene.shape)
    posed = posed_hand(hand.model, scene.angles)
    skin_m = transformed(scene.hand_to_world, posed.vertices_m)
    keypoints_m = transformed(scene.hand_to_world, posed.keypoints_m)
    # Without the wrist's bend, so that poses that bend it are seen to.
    rotation = scene.hand_to_world[:3, :3] @ posed.bones[BONE_INDEX["forearm_twist_3"], :3, :3]
    back, thumb = rotation[:, 2], rotation[:, 0] * (-1.0 if _is_right(scene) else 1.0)
    turn, rise = math.radians(aim.turn_deg), math.radians(aim.rise_deg)
    level = math.cos(turn) * back + math.sin(turn) * thumb
    outward = math.cos(rise) * level + math.sin(rise) * np.array([0.0, 0.0, 1.0])
    looked_at = skin_m[posed.vertices_m[:, 1] > -aim.arm_m]
    if not aim.arm_m:
        looked_at = skin_m[~hand.model.forearm]
    if aim.keypoints is not None:
        looked_at = _around(keypoints_m[list(aim.keypoints)], aim.reach_m)
    camera = _portrait(scene.camera.intrinsics, looked_at, outward, aim)
    seen = Seen(camera, skin_m, hand.model.hand_quads())
    environment = scene.cell.environment
    rotation_z_deg = _turned_to(environment, seen)
    level_ev = math.log2(WHITE_LEVEL / metered_light(environment, rotation_z_deg, seen))
    white = colour_on_hand(environment, rotation_z_deg, seen)
    balance = white_balance_of(white, ADAPTED)
    light = Light(environment, rotation_z_deg, round(level_ev, 4), balance)
    view = replace(scene.view, distance_m=aim.distance_m)
    return replace(scene, camera=camera, view=view, light=light)


def _turned_to(environment: str, seen: Seen) -> float:
    """Return a turn of the panorama that lights what is seen well, yet from the side: SIDE_DEG off
    the turn that lights it best.
    """
    turns = np.arange(0.0, 360.0, 15.0)
    best = max(turns.tolist(), key=lambda turn: light_on_hand(environment, turn, seen))
    return float((best + SIDE_DEG) % 360.0)


def _is_right(scene: HandScene) -> bool:
    return scene.cell.handedness == "right"


def _around(points_m: Array, reach_m: float) -> Array:
    """Return the corners of cubes about points (N, 3): (8 N, 3)."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    cubes: Array = (points_m[:, None] + reach_m * corners).reshape(-1, 3)
    return cubes


def _portrait(lens: Intrinsics, points_m: Array, outward: Array, aim: Aim) -> Camera:
    """Return an upright camera on the `outward` side whose picture the points (N, 3) fill."""
    forward = -outward
    right = np.cross(forward, np.array([0.0, 0.0, 1.0]))
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    seen = points_m @ rotation.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2.0
    world_to_camera = np.eye(4)
    world_to_camera[:3, :3] = rotation
    world_to_camera[:3, 3] = np.array([0.0, 0.0, aim.distance_m]) - middle
    flat = np.abs(((seen - middle) / (seen - middle + aim.distance_m)[:, 2:])[:, :2])
    half = float(flat.max()) * aim.margin
    if aim.span_m is not None:
        half = aim.span_m / 2.0 / aim.distance_m
    focal_px = lens.width_px / 2.0 / half
    centre_px = lens.width_px / 2.0
    square = Intrinsics(focal_px, focal_px, centre_px, centre_px, lens.width_px, lens.height_px)
    return Camera(square, world_to_camera)
