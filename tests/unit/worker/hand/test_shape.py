"""Every hand of a gender is a sound hand, and as long and broad as human hands are."""

from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender, Pose
from services.worker.hand.builds import HandFamily, build_shares
from services.worker.hand.measure import girth_m, wrist_girth_m
from services.worker.hand.model import F8, I4, HandModel
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.sections import open_hand
from services.worker.hand.shape import SHAPE_EXTREMES, HandShape
from services.worker.hand.skin import posed_hand
from services.worker.hand.subdivide import Subdivision, subdivision
from services.worker.hand.surface import triangles, volume_m3, winding_numbers
from services.worker.scene.poses import solved_angles

AVERAGE = HandShape.average()
SHAPES = dict(SHAPE_EXTREMES)
STRAIGHT = open_hand()
THUMB = [PARTS.index(p) for p in HandPart if p.value.startswith("thumb")]

# Gordon et al. 1989, mean and standard deviation, mm.
LENGTH_MM = {Gender.MALE: (193.8, 9.8), Gender.FEMALE: (180.5, 9.7)}
BREADTH_MM = {Gender.MALE: (90.4, 4.2), Gender.FEMALE: (79.4, 3.8)}


@pytest.fixture(scope="module")
def smooth(hands: dict[Gender, HandModel]) -> Subdivision:
    return subdivision(hands[Gender.MALE], 1)


@pytest.fixture(params=list(Gender))
def family(request: pytest.FixtureRequest, families: dict[Gender, HandFamily]) -> HandFamily:
    return families[request.param]


def length_and_breadth_mm(hand: HandModel, smooth: Subdivision) -> tuple[float, float]:
    """Wrist joint to the end of the straight middle finger; across the knuckles, no thumb."""
    posed = posed_hand(hand, STRAIGHT)
    skin_mm = 1000.0 * smooth.apply(posed.vertices_m)
    knuckles_mm = 1000.0 * posed.keypoints_m[[5, 17], 1].mean()
    level = np.abs(skin_mm[:, 1] - knuckles_mm) < 4.0
    row = level & ~np.isin(smooth.owners(hand.part), THUMB)
    return float(skin_mm[:, 1].max()), float(np.ptp(skin_mm[row, 0]))


def test_the_average_hand_is_the_human_mean(family: HandFamily, smooth: Subdivision) -> None:
    length_mm, breadth_mm = length_and_breadth_mm(family.shaped(AVERAGE), smooth)
    assert length_mm == pytest.approx(LENGTH_MM[family.gender][0], abs=3.0)
    assert breadth_mm == pytest.approx(BREADTH_MM[family.gender][0], abs=2.0)


@pytest.mark.parametrize(("name", "side"), [("scale_low", -1.645), ("scale_high", 1.645)])
def test_the_ends_of_scale_are_the_5th_and_95th_percentile(
    name: str, side: float, family: HandFamily, smooth: Subdivision
) -> None:
    length_mm, breadth_mm = length_and_breadth_mm(family.shaped(SHAPES[name]), smooth)
    mean_mm, deviation_mm = LENGTH_MM[family.gender]
    assert length_mm == pytest.approx(mean_mm + side * deviation_mm, abs=4.0)
    mean_mm, deviation_mm = BREADTH_MM[family.gender]
    assert breadth_mm == pytest.approx(mean_mm + side * deviation_mm, abs=4.0)


@pytest.mark.parametrize("name", SHAPES)
def test_no_shape_leaves_the_human_range(
    name: str, family: HandFamily, smooth: Subdivision
) -> None:
    length_mm, breadth_mm = length_and_breadth_mm(family.shaped(SHAPES[name]), smooth)
    for value, (mean, deviation) in (
        (length_mm, LENGTH_MM[family.gender]),
        (breadth_mm, BREADTH_MM[family.gender]),
    ):
        # One factor at its end keeps within 2.5 standard deviations; all six at once are
        # rarer than one hand in a million.
        assert abs(value - mean) < (3.8 if name.startswith("all_") else 2.5) * deviation


def girths_mm(hand: HandModel, smooth: Subdivision) -> dict[str, float]:
    """Round the wrist, the PIP of the index and the shafts before and behind it."""
    skin_m, faces, k = smooth.apply(hand.vertices_m), triangles(smooth.quads), hand.keypoints_m
    return {
        "wrist": 1000.0 * wrist_girth_m(hand.bone_heads_m, skin_m, faces),
        "shaft": 1000.0 * girth_m(0.4 * k[5] + 0.6 * k[6], k[6] - k[5], skin_m, faces),
        "joint": 1000.0 * girth_m(k[6], k[7] - k[5], skin_m, faces),
        "middle": 1000.0 * girth_m(0.5 * (k[6] + k[7]), k[7] - k[6], skin_m, faces),
    }


def test_fat_rounds_the_fingers_and_thinness_bares_their_joints(
    family: HandFamily, smooth: Subdivision
) -> None:
    low, mean, high = (
        girths_mm(family.shaped(replace(AVERAGE, weight=weight)), smooth)
        for weight in (0.0, 0.5, 1.0)
    )
    for place in ("shaft", "middle"):
        assert 1.08 < high[place] / mean[place] < 1.20
        assert 0.82 < low[place] / mean[place] < 0.94
    assert high["joint"] / high["middle"] < mean["joint"] / mean["middle"]
    assert low["joint"] / low["middle"] > 1.04 * mean["joint"] / mean["middle"]
    for girths in (low, high):
        assert abs(girths["wrist"] / mean["wrist"] - 1.0) == pytest.approx(0.075, abs=0.02)


def test_age_thickens_joints_and_thins_shafts(family: HandFamily, smooth: Subdivision) -> None:
    young, old = (
        girths_mm(family.shaped(replace(AVERAGE, age_years=age)), smooth) for age in (25.0, 90.0)
    )
    assert old["joint"] > 1.015 * young["joint"]
    assert old["shaft"] < 0.97 * young["shaft"]


def test_muscle_fills_the_ball_of_the_thumb_and_the_wrist(
    family: HandFamily, smooth: Subdivision
) -> None:
    slight, strong = (family.shaped(replace(AVERAGE, muscle=muscle)) for muscle in (0.0, 1.0))
    ball = slight.part == PARTS.index(HandPart.THUMB_METACARPAL)
    out_m = (strong.vertices_m - slight.vertices_m)[ball]
    assert np.linalg.norm(out_m, axis=1).max() > 0.006
    assert girths_mm(strong, smooth)["wrist"] > 1.1 * girths_mm(slight, smooth)["wrist"]


@pytest.mark.parametrize(("factor", "grown"), [("finger_length", 1.055), ("scale", 1.0856)])
def test_fingers_grow_in_proportion(factor: str, grown: float, family: HandFamily) -> None:
    lengths = []
    for shape in (AVERAGE, replace(AVERAGE, **{factor: 1.0})):
        hand = family.shaped(shape)
        free = [i for i, name in enumerate(hand.bone_names) if name.endswith(("al", "dle"))]
        free = [i for i in free if "metacarpal" not in hand.bone_names[i]]
        lengths.append(np.linalg.norm(hand.bone_tails_m - hand.bone_heads_m, axis=1)[free])
    np.testing.assert_allclose(lengths[1] / lengths[0], grown, atol=1e-3)


def test_rest_angles_are_measured_for_every_shape(family: HandFamily) -> None:
    old, young = (family.shaped(replace(AVERAGE, age_years=age)) for age in (90.0, 20.0))
    assert not np.array_equal(old.rest_angles_deg, young.rest_angles_deg)
    assert not np.array_equal(old.hinges, young.hinges)


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_is_a_sound_hand(name: str, family: HandFamily, smooth: Subdivision) -> None:
    hand, average = family.shaped(SHAPES[name]), family.shaped(AVERAGE)
    assert hand.quads is average.quads
    assert np.array_equal(hand.palm, average.palm)
    skin_m, faces = smooth.apply(hand.vertices_m), triangles(smooth.quads)
    assert 0.5 < volume_m3(skin_m, faces) / volume_m3(smooth.apply(average.vertices_m), faces) < 2.0
    flips = np.einsum(
        "fk,fk->f", *(_normals(m, smooth.quads) for m in (skin_m, smooth.apply(average.vertices_m)))
    )
    assert flips.min() > 0.0  # no quad has turned over
    assert hand.content_hash != average.content_hash
    mirrored = hand.mirrored()
    assert np.array_equal(mirrored.mirrored().vertices_m, hand.vertices_m)
    assert mirrored.content_hash != hand.content_hash


def _normals(skin_m: F8, quads: I4) -> F8:
    corners = skin_m[quads]
    return np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])


@pytest.mark.parametrize("name", SHAPES)
def test_keypoints_of_every_shape_lie_in_its_flesh(name: str, family: HandFamily) -> None:
    hand = family.shaped(SHAPES[name])
    faces = triangles(hand.quads)
    # Each shape takes its turn of the poses: between them, all shapes see every pose twice.
    for pose in list(Pose)[list(SHAPES).index(name) % 6 :: 6]:
        posed = posed_hand(hand, solved_angles(family.gender, pose, SHAPES[name]))
        assert winding_numbers(posed.keypoints_m, posed.vertices_m, faces).min() > 0.5


def test_shares_of_the_builds_sum_to_one() -> None:
    for _, shape in SHAPE_EXTREMES:
        shares = build_shares(shape)
        assert shares.sum() == pytest.approx(1.0)
        assert shares.min() >= 0.0
    assert np.count_nonzero(build_shares(replace(AVERAGE, age_years=18.0))) == 1
    half = build_shares(replace(AVERAGE, age_years=57.5, weight=0.0))
    np.testing.assert_allclose(half[half > 0], [0.3, 0.2, 0.3, 0.2])


@pytest.mark.parametrize(
    ("factor", "value"), [("age_years", 17.9), ("weight", -0.1), ("scale", 1.1)]
)
def test_a_factor_outside_its_range_is_named(factor: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{factor} is {value}"):
        replace(AVERAGE, **{factor: value})
