from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.angles import ANGLE_INDEX
from services.worker.hand.contact.body import Body
from services.worker.hand.family import load_family
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.scene.motion import MOTIONS, motion_angles
from services.worker.scene.noise import drawn_noise_deg, freedom, with_noise
from services.worker.scene.path import between
from services.worker.scene.pose_check import judge_pose, judged
from services.worker.scene.poses import pose_library, solved_angles
from services.worker.scene.solving import solved_pose_deg

AVERAGE = HandShape.average()


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hands")


@pytest.mark.parametrize("gender", list(Gender))
@pytest.mark.parametrize("pose", [Pose.FIST, Pose.A_OKAY, Pose.CAPISCE, Pose.GOOD_LUCK])
def test_solved_poses_touch_and_do_not_pass_through(
    gender: Gender, pose: Pose, cache: Path
) -> None:
    verdict = judge_pose(load_family(gender, cache), gender, pose, "average", AVERAGE)
    assert verdict.limit_excess_deg == 0.0
    assert verdict.depth_mm <= 1.5
    assert verdict.gap_mm <= 1.5
    assert abs(verdict.volume_change) < 0.06


def test_the_check_sees_fingers_in_the_palm(cache: Path) -> None:
    fist = solved_angles(Gender.MALE, Pose.FIST, AVERAGE)
    clenched = replace(fist, middle_pip_flex=118.0, middle_mcp_flex=98.0)
    body = Body.of(load_family(Gender.MALE, cache).shaped(AVERAGE))
    assert judged(body, clenched, "clenched").depth_mm > 1.5


def test_the_check_sees_a_pinch_that_gapes(cache: Path) -> None:
    pinch = solved_angles(Gender.MALE, Pose.A_OKAY, AVERAGE)
    loose = replace(pinch, index_pip_flex=pinch.index_pip_flex - 10.0)
    body = Body.of(load_family(Gender.MALE, cache).shaped(AVERAGE))
    assert judged(body, loose, "loose", Pose.A_OKAY).gap_mm > 1.5


@pytest.mark.parametrize("gender", list(Gender))
def test_solved_angles_keep_the_limits_on_every_shape(gender: Gender) -> None:
    for pose in Pose:
        for _, shape in SHAPE_EXTREMES:
            assert not hard_limit_excess_deg(solved_angles(gender, pose, shape)).any()


def test_solving_leaves_wrist_and_forearm_to_the_table() -> None:
    wrist = [ANGLE_INDEX[name] for name in ("wrist_flex", "wrist_ulnar_dev", "forearm_pronation")]
    for pose, angles in pose_library().items():
        solved = solved_angles(Gender.FEMALE, pose, AVERAGE).as_array()
        np.testing.assert_allclose(solved[wrist], angles.as_array()[wrist])


def test_a_way_starts_and_ends_at_its_poses() -> None:
    for target in (Pose.FIVE, Pose.GOOD_LUCK, Pose.THUMB_UP_RELAXED):
        ends = (between(Gender.MALE, AVERAGE, Pose.FIST, target, t) for t in (0.0, 1.0))
        for pose, end in zip((Pose.FIST, target), ends, strict=True):
            expected = solved_angles(Gender.MALE, pose, AVERAGE).as_array()
            np.testing.assert_allclose(end.as_array(), expected, atol=8.0)


@pytest.mark.parametrize("target", [Pose.FIVE, Pose.GOOD_LUCK, Pose.FINGER_SPREAD_RIGID])
def test_a_way_is_continuous_and_within_limits(target: Pose) -> None:
    way = [between(Gender.MALE, AVERAGE, Pose.FIST, target, t) for t in np.linspace(0.0, 1.0, 401)]
    assert not any(hard_limit_excess_deg(angles).any() for angles in way)
    steps = np.abs(np.diff([angles.as_array() for angles in way], axis=0))
    assert steps.max() < 2.5


def test_t_outside_the_way_is_refused() -> None:
    with pytest.raises(ValueError, match=r"t is 1\.5"):
        between(Gender.MALE, AVERAGE, Pose.FIST, Pose.FIVE, 1.5)


def test_noise_hangs_together_as_tendons_do() -> None:
    free = freedom(Pose.FIVE, Pose.FIVE, 0.0)
    draws = np.stack([drawn_noise_deg(free, factor_rng(1, i, "noise")) for i in range(800)])
    names = ("ring_pip_flex", "ring_dip_flex", "pinky_pip_flex", "index_pip_flex")
    pip, dip, neighbour, far = (draws[:, ANGLE_INDEX[name]] for name in names)
    assert np.corrcoef(pip, dip)[0, 1] > 0.8
    assert np.corrcoef(pip, neighbour)[0, 1] > 0.55
    assert np.corrcoef(pip, neighbour)[0, 1] > np.corrcoef(pip, far)[0, 1] + 0.1


def test_digits_that_hold_on_hardly_tremble() -> None:
    held = freedom(Pose.A_OKAY, Pose.FIVE, 0.0).digits
    assert held[0] < 0.1
    assert held[1] < 0.1
    assert held[3] == 1.0


def test_noise_is_a_function_of_its_generator(cache: Path) -> None:
    model = load_family(Gender.MALE, cache).shaped(AVERAGE)
    fist = solved_angles(Gender.MALE, Pose.FIST, AVERAGE)
    free = freedom(Pose.FIST, Pose.FIVE, 0.0)
    first, again = (with_noise(model, fist, free, factor_rng(3, 5, "noise")) for _ in range(2))
    assert first == again
    assert first != fist
    assert not hard_limit_excess_deg(first).any()


@pytest.mark.parametrize("pose", list(MOTIONS))
def test_motions_loop_and_move(pose: Pose) -> None:
    phases = np.linspace(0.0, 1.0, 201)
    way = np.stack(
        [motion_angles(Gender.FEMALE, AVERAGE, pose, float(p)).as_array() for p in phases]
    )
    np.testing.assert_allclose(way[0], way[-1], atol=1e-9)
    assert np.abs(np.diff(way, axis=0)).max() < 2.0
    assert np.ptp(way, axis=0).max() > 20.0


def test_the_file_of_solved_poses_is_what_the_solver_finds(cache: Path) -> None:
    body = Body.of(load_family(Gender.FEMALE, cache).shaped(AVERAGE))
    for pose in (Pose.INDEX_TIP, Pose.NEUTRAL_RIGID):
        table = pose_library()[pose].as_array()
        again = solved_pose_deg(body, pose, table, None)
        filed = solved_angles(Gender.FEMALE, pose, AVERAGE).as_array()
        np.testing.assert_allclose(again, filed, atol=0.5)
