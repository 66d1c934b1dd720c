"""Labels of sampled scenes against a second computation that reads nothing but the label itself.

Matrices, points and masks come from the label's JSON; sizes, seeds and cells are all different.
"""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pycocotools import mask as coco_mask

from hi5_common.domain.affect import POSE_AFFECT
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, LabelKind, parse_spec
from hi5_common.domain.vocabulary import Gender, Handedness, KeypointVisibility
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.skin import posed_hand
from services.worker.label.label import label_image
from services.worker.label.projected import project_mesh
from services.worker.label.raster import rasterise
from services.worker.ornaments.mesh import OrnamentMesh
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.poses import pose_library, solved_angles
from services.worker.scene.sampling import hand_to_world, sample_scene
from services.worker.scene.types import HandScene, Intrinsics, PolarView, SceneGeometry, Stance
from services.worker.scene.view import camera_at

F8 = npt.NDArray[np.float64]
SIZES = ((640, 480), (200, 500), (96, 64))


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


def _spec(number: int) -> DatasetSpec:
    width, height = SIZES[number % len(SIZES)]
    document = {"count": 500 + number, "seed": 1000 * number + 7}
    return parse_spec({**document, "image": {"width": width, "height": height}})


def _labelled(scene: HandScene, geometry: SceneGeometry) -> dict[str, Any]:
    mesh = project_mesh(scene.camera, geometry)
    kinds = frozenset(LabelKind)
    label = label_image(scene, geometry, rasterise(mesh), kinds, file_name="0.jpg", resolved={})
    document: dict[str, Any] = json.loads(label.model_dump_json())
    return document


def _decoded(mask: dict[str, Any]) -> npt.NDArray[np.bool_]:
    decoded: npt.NDArray[np.uint8] = coco_mask.decode(
        {"size": mask["size"], "counts": mask["counts"].encode()}
    )
    return decoded > 0


def _first_hit(origin: F8, way: F8, triangles_m: F8) -> tuple[int, float] | None:
    """Return the first triangle (T, 3, 3) on a ray (Möller and Trumbore 1997), if there is one.

    And where on the ray, in lengths of `way`.
    """
    a, side, other = (
        triangles_m[:, 0],
        *(triangles_m[:, corner] - triangles_m[:, 0] for corner in (1, 2)),
    )
    p, s = np.cross(way, other), origin - a
    q = np.cross(s, side)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / (side * p).sum(axis=1)
        u, v, t = (s * p).sum(axis=1) * scale, (q @ way) * scale, (other * q).sum(axis=1) * scale
    distance = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    first = int(distance.argmin())
    return (first, float(distance[first])) if np.isfinite(distance[first]) else None


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
@pytest.mark.parametrize("number", range(9))
def test_a_label_agrees_with_its_own_matrices_and_masks(hands: HandLibrary, number: int) -> None:
    spec = _spec(number)
    scene = sample_scene(spec, Plan.of(spec), 37 * number, hands)
    geometry = build_geometry(scene, hands)
    label = _labelled(scene, geometry)
    points = label["keypoints"]
    world = np.array([[*point["world_m"], 1.0] for point in points])
    camera_m = (np.array(label["camera"]["world_to_camera_m"]) @ world.T).T[:, :3]
    homogeneous = camera_m @ np.array(label["camera"]["intrinsics_px"]).T
    pixels = homogeneous[:, :2] / homogeneous[:, 2:]
    assert np.abs(camera_m - [point["camera_m"] for point in points]).max() < 1e-12
    assert np.abs(pixels - [point["image_px"] for point in points]).max() < 1e-6
    _check_masks(label, pixels)
    _check_rays(label, geometry, number)
    _check_sights(label, geometry)
    assert label["in_frame_share"] >= 0.75
    assert label["affect"] == POSE_AFFECT[scene.cell.pose]


def _check_masks(label: dict[str, Any], pixels: F8) -> None:
    whole, hand = _decoded(label["mask"]), _decoded(label["hand_mask"])
    assert whole.shape == (label["height_px"], label["width_px"])
    assert (whole.sum(), hand.sum()) == (label["mask"]["area_px"], label["hand_mask"]["area_px"])
    assert not (hand & ~whole).any()
    for mask, box in ((whole, label["box"]), (hand, label["hand_box"])):
        rows, columns = np.nonzero(mask)
        assert box["x_px"] <= columns.min() + 0.5
        assert columns.max() + 0.5 <= box["x_px"] + box["width_px"]
        assert box["y_px"] <= rows.min() + 0.5
        assert rows.max() + 0.5 <= box["y_px"] + box["height_px"]
    for point, (x, y) in zip(label["keypoints"], pixels, strict=True):
        if point["visibility"] == KeypointVisibility.VISIBLE:
            assert whole[int(y), int(x)], point


def _check_rays(label: dict[str, Any], geometry: SceneGeometry, number: int) -> None:
    """Compare the masks at some pixels with rays cast in the world."""
    whole, hand = _decoded(label["mask"]), _decoded(label["hand_mask"])
    extrinsics = np.array(label["camera"]["world_to_camera_m"])
    to_world = extrinsics[:3, :3].T
    corners = np.concatenate([geometry.quads[:, [0, 1, 2]], geometry.quads[:, [0, 2, 3]]])
    is_hand = (geometry.part[corners] != PARTS.index(HandPart.FOREARM)).all(axis=1)
    rng = np.random.default_rng(number)
    for row, column in rng.integers(0, whole.shape, (12, 2)).tolist():
        ray = np.linalg.solve(label["camera"]["intrinsics_px"], [column + 0.5, row + 0.5, 1.0])
        hit = _first_hit(
            -to_world @ extrinsics[:3, 3], to_world @ ray, geometry.vertices_m[corners]
        )
        assert whole[row, column] == (hit is not None)
        assert hand[row, column] == (hit is not None and is_hand[hit[0]])


def _check_sights(label: dict[str, Any], geometry: SceneGeometry) -> None:
    """Compare what is said of each joint with the ray from the lens to it, cast in the world."""
    extrinsics = np.array(label["camera"]["world_to_camera_m"])
    lens_m = -extrinsics[:3, :3].T @ extrinsics[:3, 3]
    starts = np.cumsum(
        [0, len(geometry.vertices_m), *(len(o.vertices_m) for o in geometry.ornaments)]
    )
    surfaces: tuple[SceneGeometry | OrnamentMesh, ...] = (geometry, *geometry.ornaments)
    quads = np.concatenate([s.quads + start for s, start in zip(surfaces, starts, strict=False)])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    vertices_m = np.concatenate([surface.vertices_m for surface in surfaces])
    hidden = 0
    for point in label["keypoints"]:
        way = np.array(point["world_m"]) - lens_m
        hit = _first_hit(lens_m, way, vertices_m[triangles])
        if point["visibility"] == KeypointVisibility.OUT_OF_FRAME:
            continue
        if hit is None or hit[1] >= 1.0:
            assert point["visibility"] == KeypointVisibility.VISIBLE
            assert point["depth_margin_mm"] is None
            continue
        margin_mm = (1.0 - hit[1]) * np.linalg.norm(way) * 1000.0
        assert point["depth_margin_mm"] == pytest.approx(margin_mm, abs=1e-6)
        if point["visibility"] == KeypointVisibility.SELF_OCCLUDED:
            hidden += 1
            near = vertices_m[triangles[hit[0]]]
            at = lens_m + hit[1] * way
            apart = np.linalg.norm(near - at, axis=1)
            owners = [_owner(geometry, vertex, starts) for vertex in triangles[hit[0]]]
            # The nearest corner's, or one as good as nearest.
            assert point["occluder"] in {
                owner
                for owner, far in zip(owners, apart, strict=True)
                if far <= apart.min() * 1.5 + 1e-4
            }
    assert hidden < len(label["keypoints"])


def _owner(geometry: SceneGeometry, vertex: int, starts: npt.NDArray[np.int_]) -> str:
    """Return the part of the hand or the ornament that a vertex belongs to."""
    surface = int(np.searchsorted(starts, vertex, side="right")) - 1
    if surface == 0:
        return PARTS[int(geometry.part[vertex])].value
    return geometry.ornaments[surface - 1].name.value


@pytest.mark.parametrize("number", range(8))
def test_handedness_is_in_the_points(hands: HandLibrary, number: int) -> None:
    """Wrist, index and little knuckle wind the one way round the palm's side on right hands."""
    spec = _spec(number)
    scene = sample_scene(spec, Plan.of(spec), 5 * number + 1, hands)
    geometry = build_geometry(scene, hands)
    points = [point["world_m"] for point in _labelled(scene, geometry)["keypoints"]]
    wrist, index, little = (np.array(points[row]) for row in (0, 5, 17))
    palm = geometry.part == PARTS.index(HandPart.PALM)
    back_m, front_m = (
        geometry.vertices_m[palm & side].mean(axis=0)
        for side in (geometry.palm < 0.2, geometry.palm > 0.8)
    )
    winding = float(np.cross(index - wrist, little - wrist) @ (front_m - back_m))
    assert (winding > 0) == (scene.cell.handedness is Handedness.RIGHT)


@pytest.mark.parametrize("gender", Gender)
def test_a_left_hand_is_the_mirror_image_and_bones_keep_their_lengths(
    hands: HandLibrary, gender: Gender
) -> None:
    right, left = (hands.hand(gender, side).model for side in Handedness)
    lengths_m = np.linalg.norm(right.bone_tails_m - right.bone_heads_m, axis=1)
    for angles in list(pose_library().values())[::6]:
        one, other = posed_hand(right, angles), posed_hand(left, angles)
        assert np.array_equal(other.keypoints_m * [-1.0, 1.0, 1.0], one.keypoints_m)
        assert np.abs(other.vertices_m * [-1.0, 1.0, 1.0] - one.vertices_m).max() < 1e-12
        heads, tails = (
            np.einsum("bij,bj->bi", one.bones[:, :3, :3], ends) + one.bones[:, :3, 3]
            for ends in (right.bone_heads_m, right.bone_tails_m)
        )
        assert np.abs(np.linalg.norm(tails - heads, axis=1) - lengths_m).max() < 1e-9


@pytest.mark.parametrize("elevation_deg", [-30.0, 0.0, 30.0])
def test_the_wrist_of_an_open_hand_shows_from_all_sides_but_the_thumbs(
    hands: HandLibrary, elevation_deg: float
) -> None:
    average = {"age": [35], "weight": [0.5], "muscle": [0.5], "hand_scale": [0]}
    average |= {"finger_length": [0], "finger_thickness": [0]}
    wanted = {"pose": ["finger_spread_normal"], "gender": ["male"], **average}
    spec = parse_spec({"count": 1, "seed": 3, "attributes": wanted})
    scene = sample_scene(spec, Plan.of(spec), 0, hands)
    stance = hand_to_world(Stance(90.0, 0.0), scene.cell)
    still = solved_angles(scene.cell.gender, scene.cell.pose, scene.shape)
    upright = replace(scene, hand_to_world=stance, angles=still)
    geometry = build_geometry(upright, hands)
    lens = Intrinsics(400.0, 400.0, 160.0, 160.0, 320, 320)
    for azimuth_deg in (0, 30, 60, 120, 150, 180, 210, 240, 270, 300, 330):  # the thumb is at 90
        view = PolarView(float(azimuth_deg), elevation_deg, 0.6, 0.0, 0.0, 0.0)
        camera = camera_at(view, geometry.keypoints_m.mean(axis=0), lens)
        wrist = _labelled(replace(upright, camera=camera), geometry)["keypoints"][0]
        assert wrist["visibility"] == KeypointVisibility.VISIBLE, (azimuth_deg, wrist)
