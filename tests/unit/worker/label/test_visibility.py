from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.vocabulary import KEYPOINTS, KeypointVisibility
from services.worker.hand.parts import KEYPOINT_PARTS, PARTS, HandPart
from services.worker.label.box import tight_box
from services.worker.label.occluders import is_hand, occluder_of
from services.worker.label.projected import project_mesh
from services.worker.label.projection import F8, to_camera, to_pixels
from services.worker.label.raster import rasterise
from services.worker.label.visibility import OWN_FLESH_MM, Sight, sight_keypoints
from services.worker.ornaments.mesh import OrnamentName
from tests.unit.worker.label.shapes import CAMERA, LENS, box, scene_of, worn_box

PIP = KEYPOINTS.index("forefinger2")
POINT = (0.05, 0.01, 0.5)
FINGER = box(POINT, (0.03, 0.008, 0.008))
THUMB = box((0.045, 0.009, 0.45), (0.01, 0.01, 0.01))


def _sight(boxes: list[F8], parts: list[HandPart], point: tuple[float, float, float]) -> Sight:
    keypoints = np.tile(np.array(point), (len(KEYPOINTS), 1))
    geometry = scene_of(boxes, [PARTS.index(part) for part in parts], keypoints)
    camera_m = to_camera(CAMERA, keypoints)
    pixels = to_pixels(LENS, camera_m)
    return sight_keypoints(project_mesh(CAMERA, geometry), geometry.part, camera_m, pixels)[PIP]


def test_its_own_flesh_does_not_hide_a_joint() -> None:
    sight = _sight([FINGER], [HandPart.INDEX_MIDDLE], POINT)
    assert (sight.visibility, sight.occluder) == (KeypointVisibility.VISIBLE, None)
    along = float(np.linalg.norm(POINT)) / POINT[2]
    assert sight.depth_margin_mm == pytest.approx(8.0 * along)


def test_another_finger_in_front_hides_it_and_is_named() -> None:
    sight = _sight([FINGER, THUMB], [HandPart.INDEX_MIDDLE, HandPart.THUMB_DISTAL], POINT)
    assert sight.visibility is KeypointVisibility.SELF_OCCLUDED
    assert sight.occluder is HandPart.THUMB_DISTAL
    along = float(np.linalg.norm(POINT)) / POINT[2]
    assert sight.depth_margin_mm == pytest.approx(60.0 * along)


def test_another_finger_behind_hides_nothing() -> None:
    behind = box((0.05, 0.01, 0.6), (0.05, 0.05, 0.01))
    sight = _sight([FINGER, behind], [HandPart.INDEX_MIDDLE, HandPart.PALM], POINT)
    assert sight.visibility is KeypointVisibility.VISIBLE


def test_too_much_of_its_own_flesh_hides_it() -> None:
    end_on = box((0.05, 0.01, 0.48), (0.008, 0.008, 0.045))
    sight = _sight([end_on], [HandPart.INDEX_MIDDLE], POINT)
    assert sight.visibility is KeypointVisibility.SELF_OCCLUDED
    assert sight.occluder is HandPart.INDEX_MIDDLE


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((5.0, 0.0, 0.5), KeypointVisibility.OUT_OF_FRAME),
        ((0.0, 0.0, -0.5), KeypointVisibility.BEHIND_CAMERA),
        ((0.0, 0.0, 0.0), KeypointVisibility.BEHIND_CAMERA),
    ],
)
def test_outside_the_view(point: tuple[float, float, float], expected: KeypointVisibility) -> None:
    assert _sight([FINGER], [HandPart.INDEX_MIDDLE], point) == Sight(expected, None, None)


def test_every_keypoint_has_a_thickness_and_parts() -> None:
    assert len(OWN_FLESH_MM) == len(KEYPOINT_PARTS) == len(KEYPOINTS)


@pytest.mark.parametrize("name", OrnamentName)
def test_what_is_worn_in_front_hides_a_joint_and_is_named(name: OrnamentName) -> None:
    keypoints = np.tile(np.array(POINT), (len(KEYPOINTS), 1))
    bare = scene_of([FINGER], [PARTS.index(HandPart.INDEX_MIDDLE)], keypoints)
    geometry = replace(bare, ornaments=(worn_box(name, (0.04, 0.008, 0.4)),))
    camera_m = to_camera(CAMERA, keypoints)
    mesh = project_mesh(CAMERA, geometry)
    occluder = occluder_of(geometry)
    sight = sight_keypoints(mesh, occluder, camera_m, to_pixels(LENS, camera_m))[PIP]
    assert (sight.visibility, sight.occluder) == (KeypointVisibility.SELF_OCCLUDED, name)


def test_masks_count_what_is_worn_and_hand_masks_leave_it_out() -> None:
    bare = scene_of([FINGER], [PARTS.index(HandPart.INDEX_MIDDLE)])
    geometry = replace(bare, ornaments=(worn_box(OrnamentName.RING, (0.05, 0.04, 0.4)),))
    seen = [rasterise(project_mesh(CAMERA, scene)) for scene in (bare, geometry)]
    assert seen[1].covered.sum() > seen[0].covered.sum()
    of_hand = is_hand(occluder_of(geometry))
    assert of_hand.tolist() == [True] * 8 + [False] * 8
    hand_box = tight_box(project_mesh(CAMERA, geometry), of_hand)
    assert hand_box == tight_box(project_mesh(CAMERA, bare), np.ones(8, dtype=np.bool_))
