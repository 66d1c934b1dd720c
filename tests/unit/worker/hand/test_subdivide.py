import numpy as np
import pytest

from services.worker.hand.model import HandModel
from services.worker.hand.subdivide import refined, subdivision
from services.worker.hand.surface import triangles, volume_m3

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
CUBE_QUADS = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
    dtype=np.int32,
)
CUBE_UVS = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32), (6, 1, 1))


@pytest.mark.parametrize("levels", [0, 1, 2])
def test_counts_and_closedness(hand: HandModel, levels: int) -> None:
    smooth = subdivision(hand, levels)
    faces = len(hand.quads) * 4**levels
    assert smooth.quads.shape == (faces, 4)
    assert smooth.uvs.shape == (faces, 4, 2)
    assert smooth.vertex_count == faces + 2  # Euler's formula on a sphere of quads
    pairs = np.stack([smooth.quads, np.roll(smooth.quads, -1, axis=1)], axis=2).reshape(-1, 2)
    assert len(np.unique(pairs, axis=0)) == 4 * faces
    assert set(np.unique(np.sort(pairs, axis=1), axis=0, return_counts=True)[1]) == {2}


def test_constants_are_preserved(hand: HandModel) -> None:
    smooth = subdivision(hand, 2)
    np.testing.assert_allclose(smooth.apply(np.ones(len(hand.vertices_m))), 1.0, atol=1e-12)
    assert smooth.values.min() > 0.0


def test_a_cube_becomes_what_the_rules_say() -> None:
    smooth = refined(8, CUBE_QUADS, CUBE_UVS, 1).apply(CUBE)
    # Corner: ((3 - 2) P + neighbours' mean + faces' mean) / 3, edge: mean of ends and faces.
    assert smooth.shape == (26, 3)
    np.testing.assert_allclose(np.abs(smooth[:8]), 5.0 / 9.0)
    np.testing.assert_allclose(np.sort(np.abs(smooth[8:20]), axis=1), [[0.0, 0.75, 0.75]] * 12)
    np.testing.assert_allclose(np.sort(np.abs(smooth[20:]), axis=1), [[0.0, 0.0, 1.0]] * 6)


def test_two_levels_are_one_level_twice() -> None:
    once = refined(8, CUBE_QUADS, CUBE_UVS, 1)
    again = refined(once.vertex_count, once.quads, once.uvs, 1)
    twice = refined(8, CUBE_QUADS, CUBE_UVS, 2)
    np.testing.assert_allclose(twice.apply(CUBE), again.apply(once.apply(CUBE)), atol=1e-12)
    assert np.array_equal(twice.quads, again.quads)
    assert np.array_equal(twice.uvs, again.uvs)


def test_winding_is_kept_and_the_surface_shrinks(hand: HandModel) -> None:
    smooth = subdivision(hand, 1)
    fine = volume_m3(smooth.apply(hand.vertices_m), triangles(smooth.quads))
    coarse = volume_m3(hand.vertices_m, triangles(hand.quads))
    assert 0.9 * coarse < fine < coarse


def test_uvs_belong_to_their_corners() -> None:
    fine = refined(8, CUBE_QUADS, CUBE_UVS, 1)
    for row, quad in enumerate(fine.quads):
        assert quad[0] < 8
        assert tuple(fine.uvs[row, 0]) == tuple(CUBE_UVS[row // 4, row % 4])
        assert tuple(fine.uvs[row, 2]) == (0.5, 0.5)


def test_labels_follow_the_heaviest_vertex(hand: HandModel) -> None:
    smooth = subdivision(hand, 1)
    parts = smooth.owners(hand.part)
    assert np.array_equal(parts[: len(hand.part)], hand.part)
    assert set(parts) == set(hand.part)


def test_negative_levels_are_refused(hand: HandModel) -> None:
    with pytest.raises(ValueError, match="-1"):
        subdivision(hand, -1)
