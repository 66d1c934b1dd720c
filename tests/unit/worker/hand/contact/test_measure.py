import numpy as np
import pytest

from hi5_common.domain.vocabulary import Pose
from services.worker.hand import surface
from services.worker.hand.contact.measure import gap_m, self_penetration, winding_numbers
from services.worker.hand.model import F8, I4, HandModel
from services.worker.hand.pose import posed_bones
from services.worker.hand.skin import skinned
from services.worker.hand.subdivide import subdivision
from services.worker.scene.poses import pose_library


def boxes(*corners: tuple[float, float, float]) -> tuple[F8, I4]:
    """Cubes of 1 cm with their lowest corners here (in metres), each cut into 4 by 4 faces."""
    line = np.linspace(0.0, 0.01, 5)
    faces = []
    for axis in range(3):
        for end in (0.0, 0.01):
            for i in range(4):
                for j in range(4):
                    u, v = line[[i, i + 1, i + 1, i]], line[[j, j, j + 1, j + 1]]
                    square = np.insert(np.stack([u, v], axis=1), axis, end, axis=1)
                    outward = (end > 0) != (axis == 1)
                    faces.append(square if outward else square[::-1])
    one = np.concatenate(faces)
    points = np.concatenate([one + np.array(corner) for corner in corners])
    found, rows = np.unique(points.round(9), axis=0, return_inverse=True)
    return found, rows.reshape(-1, 4).astype(np.int32)


def raw_skin(hand: HandModel, pose: Pose) -> tuple[F8, I4]:
    """The smooth skin in a pose of the table as plain skinning leaves it."""
    bones = posed_bones(hand, pose_library()[pose])
    skin = skinned(hand.vertices_m, hand.rotation_centres_m, hand.weights, bones)
    fine = subdivision(hand, 1)
    return fine.apply(skin), fine.quads


def test_windings_are_those_of_solid_angles(hand: HandModel) -> None:
    skin_m, quads = raw_skin(hand, Pose.FIST)
    rng = np.random.Generator(np.random.Philox(7))
    points = rng.choice(skin_m, 600) + rng.normal(0.0, 0.001, size=(600, 3))
    triangles = surface.triangles(quads)
    counted = winding_numbers(points, skin_m[triangles])
    assert set(np.unique(counted)) >= {0, 1, 2}
    np.testing.assert_array_equal(
        counted, np.rint(surface.winding_numbers(points, skin_m, triangles))
    )


def test_boxes_apart_do_not_overlap() -> None:
    points, quads = boxes((0.0, 0.0, 0.0), (0.0, 0.0, 0.0115))
    assert self_penetration(points, quads).deepest_m == 0.0


def test_the_depth_of_overlapping_boxes_is_known() -> None:
    points, quads = boxes((0.0, 0.0, 0.0), (0.0011, 0.0013, 0.0077))
    assert self_penetration(points, quads).deepest_m == pytest.approx(0.0023, abs=2e-4)


def test_the_gap_between_boxes_is_known() -> None:
    points, quads = boxes((0.0, 0.0, 0.0), (0.0011, 0.0013, 0.0118))
    below = points[:, 2] < 0.011
    assert gap_m(points, quads, below, ~below) == pytest.approx(0.0018, abs=1e-6)


def test_an_unsolved_fist_is_found_out(hand: HandModel) -> None:
    assert self_penetration(*raw_skin(hand, Pose.FIST)).deepest_m > 0.004


def test_an_open_hand_is_clean(hand: HandModel) -> None:
    assert len(self_penetration(*raw_skin(hand, Pose.FIVE)).rows) == 0
