"""Skin maps show the right things in the right places, without seams, and are compiled once."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.angles import JointAngles
from services.worker.hand.model import HandModel
from services.worker.hand.skinmaps import store
from services.worker.hand.skinmaps.anatomy import Skin, joints, near, skin_of_hand
from services.worker.hand.skinmaps.atlas import atlas_uvs
from services.worker.hand.skinmaps.creases import Creases, creases_of
from services.worker.hand.skinmaps.maps import HALVED_FROM_PX, SkinMaps, skin_maps
from services.worker.hand.skinmaps.nails import nails_of
from services.worker.hand.skinmaps.noise import value_noise
from services.worker.hand.skinmaps.planes import Plane
from services.worker.hand.skinmaps.slack import TAUT_REST, slack
from services.worker.hand.skinmaps.store import MapLevel, load_skin_maps
from services.worker.hand.subdivide import subdivision
from services.worker.hand.surface import triangles, vertex_areas_m2

SIDE_PX = 256


@pytest.fixture(scope="module")
def skin(hands: dict[Gender, HandModel]) -> Skin:
    return skin_of_hand(hands[Gender.MALE], SIDE_PX)


@pytest.fixture(scope="module")
def creases(skin: Skin) -> Creases:
    return creases_of(skin)


@pytest.fixture(scope="module")
def maps(hands: dict[Gender, HandModel]) -> SkinMaps:
    return skin_maps(hands[Gender.MALE], SIDE_PX)


def test_the_atlas_lies_in_the_unit_square_without_overlap(hand: HandModel) -> None:
    uvs = atlas_uvs(hand.uvs)
    assert uvs.min() >= 0.0
    assert uvs.max() <= 1.0
    hits = np.zeros((SIDE_PX * 2, SIDE_PX * 2), dtype=np.int32)
    corners = np.concatenate([uvs[:, [0, 1, 2]], uvs[:, [0, 2, 3]]]) * (2 * SIDE_PX)
    for corner in corners:
        cover = np.zeros_like(hits, dtype=np.uint8)
        shrunk = corner.mean(axis=0) + 0.6 * (corner - corner.mean(axis=0))
        low, high = (
            np.floor(shrunk.min(axis=0)).astype(int),
            np.ceil(shrunk.max(axis=0)).astype(int),
        )
        cut = cover[low[1] : high[1] + 1, low[0] : high[0] + 1]
        cv2.fillConvexPoly(cut, np.floor(shrunk - low).astype(np.int32), 1.0)
        hits[low[1] : high[1] + 1, low[0] : high[0] + 1] += cut
    # Triangles smaller than a pixel share one; nothing is covered twice over a wide area.
    assert (cv2.erode((hits > 1).astype(np.uint8), np.ones((5, 5), np.uint8)) == 0).all()


def test_texels_stand_for_the_skins_area_and_place(
    skin: Skin, hands: dict[Gender, HandModel]
) -> None:
    model = hands[Gender.MALE]
    surface = subdivision(model, 2)
    smooth_m = surface.apply(model.vertices_m)
    hand = surface.apply((~model.forearm).astype(np.float64)) > 0.5
    true_m2 = vertex_areas_m2(smooth_m, surface.quads)[hand].sum()
    found_m2 = skin.texels.area_m2[skin.forearm < 0.5].sum()
    assert found_m2 == pytest.approx(true_m2, rel=0.06)
    faces = triangles(surface.quads)
    assert skin.texels.corners.max() < len(smooth_m)
    assert len(faces) == 2 * len(surface.quads)
    assert skin.points_mm.min(axis=0)[2] < -10.0


def test_palms_are_glabrous_and_backs_are_not(skin: Skin, maps: SkinMaps) -> None:
    glabrous = maps.plane(Plane.GLABROUS).reshape(-1)[skin.texels.pixels] / 255.0
    palm = (skin.facing < -0.6) & (skin.points_mm[:, 1] > 25.0)
    assert np.median(glabrous[palm]) > 0.75
    assert glabrous[skin.dorsum].mean() < 0.02
    assert glabrous[skin.forearm > 0.9].mean() < 0.03
    border = (glabrous > 0.2) & (glabrous < 0.7)
    # The border is gradual: a good part of the hand is neither one nor the other.
    hand = skin.forearm < 0.5
    share = skin.texels.area_m2[border & hand].sum() / skin.texels.area_m2[hand].sum()
    assert 0.04 < share < 0.25


def test_creases_lie_where_digits_bend(skin: Skin, creases: Creases) -> None:
    for joint in joints(skin.model):
        if joint.name == "mcp":
            continue
        rows, local_mm = near(skin, joint, 9.0)
        palmar = skin.facing[rows] < -0.7
        at, off = (
            creases.flexion[rows[palmar & here]].mean()
            for here in (np.abs(local_mm[:, 0]) < 1.5, np.abs(local_mm[:, 0]) > 5.0)
        )
        assert at > 0.15, (joint.digit, joint.name)
        assert at > 3.0 * off, (joint.digit, joint.name)
        dorsal = skin.facing[rows] > 0.7
        assert creases.dorsal_mm[rows[dorsal]].min() < -0.05
    assert creases.flexion[skin.facing > 0.3].max() == 0.0
    assert creases.flexion_mm.min() < -0.2


def test_two_people_can_have_lines_in_other_places(skin: Skin, creases: Creases) -> None:
    palm = (skin.facing < -0.6) & (skin.points_mm[:, 1] > 15.0) & (skin.digit == -1)
    first, second, _ = (lines[palm] for lines in creases.palm)
    for lines in (first, second):
        assert 0.01 < (lines > 0.4).mean() < 0.2
    assert (np.minimum(first, second) > 0.4).mean() < 0.35 * (first > 0.4).mean()
    assert max(lines[skin.facing > 0.3].max() for lines in creases.palm) == 0.0


def test_one_crease_runs_round_the_ball_of_the_thumb(skin: Skin, creases: Creases) -> None:
    """Whoever walks from the middle of the palm to the thumb's root crosses one strong line."""
    joint = next(j for j in joints(skin.model) if j.digit == 0 and j.name == "mcp")
    start_mm = np.array([0.0, 45.0])
    for lines in creases.palm[:2]:
        palm = np.flatnonzero((skin.facing < -0.2) & (skin.digit <= 0))
        way_mm = np.linspace(start_mm, joint.centre_mm[:2], 60)
        far_mm = np.linalg.norm(way_mm[:, None] - skin.points_mm[None, palm, :2], axis=2)
        met = np.where(far_mm < 1.2, lines[palm][None], 0.0).max(axis=1) > 0.45
        assert int((np.diff(met.astype(int)) == 1).sum()) == 1


def test_each_digit_has_one_nail_of_human_size(skin: Skin) -> None:
    nails = nails_of(skin)
    for digit in range(5):
        own = (skin.digit == digit) & (nails.plate > 0.5)
        area_mm2 = 1e6 * skin.texels.area_m2[own].sum()
        assert 40.0 < area_mm2 < 230.0, digit
        assert (skin.facing[own] > -0.1).mean() > 0.95
    assert nails.along[nails.plate > 0.5].max() > 0.9
    moons = [nails.lunula[skin.digit == digit].max() for digit in range(5)]
    assert moons[0] == max(moons) > 0.9
    assert moons[4] == 0.0


def test_maps_do_not_jump_at_seams(skin: Skin, maps: SkinMaps) -> None:
    """Points of skin that touch in space look alike wherever the atlas keeps them."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(skin.points_mm).query_pairs(0.35, output_type="ndarray")
    pixels = skin.texels.pixels[pairs]
    apart = np.abs(pixels[:, 0] % SIDE_PX - pixels[:, 1] % SIDE_PX) + np.abs(
        pixels[:, 0] // SIDE_PX - pixels[:, 1] // SIDE_PX
    )
    across = (apart > 8) & (
        np.einsum("ni,ni->n", skin.normals[pairs[:, 0]], skin.normals[pairs[:, 1]]) > 0.7
    )
    assert across.sum() > 50
    for plane in (Plane.GLABROUS, Plane.MOTTLE_A, Plane.MELANIN):
        values = maps.plane(plane).reshape(-1)[pixels[across]].astype(np.float64) / 255.0
        assert np.abs(values[:, 0] - values[:, 1]).mean() < 0.03


def test_noise_is_a_smooth_function_of_place() -> None:
    line_mm = np.stack([np.linspace(-80.0, 80.0, 4001)] + [np.full(4001, 3.3)] * 2, axis=1)
    values = value_noise(line_mm, 5.0, "test")
    assert np.abs(np.diff(values)).max() < 0.05
    assert values.std() > 0.2
    assert np.array_equal(values[::-1], value_noise(line_mm[::-1], 5.0, "test"))
    assert not np.allclose(values, value_noise(line_mm, 5.0, "other"))


def test_skin_is_slack_where_straight_and_taut_where_bent(hands: dict[Gender, HandModel]) -> None:
    model = hands[Gender.MALE]
    straight = JointAngles.from_array(np.zeros(26))
    assert slack(model, straight).min() > 0.99
    bent = replace(straight, index_pip_flex=95.0)
    found = slack(model, bent)
    pip = next(j for j in joints(model) if j.name == "pip" and j.digit == 1)
    far_mm = np.linalg.norm(1000.0 * model.vertices_m - pip.centre_mm, axis=1)
    assert found[far_mm < 9.0].mean() < TAUT_REST + 0.35
    assert found[far_mm > 60.0].min() > 0.9


def test_maps_are_compiled_once_and_made_anew_when_damaged(
    hand_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []

    def counted(model: HandModel, side_px: int) -> SkinMaps:
        made.append(side_px)
        return skin_maps(model, SIDE_PX)

    monkeypatch.setattr(store, "skin_maps", counted)
    first = load_skin_maps(Gender.FEMALE, MapLevel.COARSE, hand_cache)
    again = load_skin_maps(Gender.FEMALE, MapLevel.COARSE, hand_cache)
    assert made == [512]
    assert np.array_equal(first.dorsum, again.dorsum)
    marks = next(hand_cache.glob("skin-female-512-*")) / store.MARKS_FILE
    whole = marks.read_bytes()
    marks.write_bytes(whole[:-100])
    load_skin_maps(Gender.FEMALE, MapLevel.COARSE, hand_cache)
    assert made == [512, 512]
    assert marks.read_bytes() == whole


def test_larger_maps_show_the_same_hand(
    skin: Skin, hands: dict[Gender, HandModel], maps: SkinMaps
) -> None:
    large = skin_maps(hands[Gender.MALE], HALVED_FROM_PX)
    side = HALVED_FROM_PX // SIDE_PX
    for plane in (Plane.GLABROUS, Plane.VEINS_A, Plane.BLOOD, Plane.NAIL):
        blocks = large.plane(plane).reshape(SIDE_PX, side, SIDE_PX, side).mean(axis=(1, 3))
        apart = np.abs(blocks - maps.plane(plane)).reshape(-1)[skin.texels.pixels]
        assert np.median(apart) <= 2.0, plane
        assert apart.mean() < 6.0, plane
    assert np.abs(large.dorsum.mean(axis=0) - maps.dorsum.mean(axis=0)).max() < 0.03
