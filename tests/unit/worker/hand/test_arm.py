import numpy as np
import pytest

from services.worker.hand.arm import LONGEST_ARM_M, tube_ring_rows, with_arm
from services.worker.hand.model import HandModel
from services.worker.hand.rotation import unit
from services.worker.hand.sections import open_hand
from services.worker.hand.skin import posed_hand
from services.worker.hand.surface import triangles, volume_m3


def test_the_tube_is_rings_on_planes_across_the_forearm(hand: HandModel) -> None:
    way = unit(hand.bone_heads_m[0])
    for ring in tube_ring_rows(hand):
        assert hand.forearm[ring].all()
        assert np.ptp(hand.vertices_m[ring] @ way) < 0.001  # builds blend


def test_the_last_ring_is_smooth(hand: HandModel) -> None:
    ring = hand.vertices_m[tube_ring_rows(hand)[-3]]
    steps = np.diff(np.concatenate([ring, ring[:2]]), axis=0)
    turn = np.einsum("nk,nk->n", unit(steps[:-1]), unit(steps[1:]))
    assert np.degrees(np.arccos(turn)).max() < 40.0  # the asset's elbow turns by more than 90


@pytest.mark.parametrize("length_m", [0.4, 0.8])
def test_an_arm_grows_straight_and_leaves_the_hand_alone(hand: HandModel, length_m: float) -> None:
    longer = with_arm(hand, length_m)
    kept = ~hand.forearm
    assert np.array_equal(longer.vertices_m[kept], hand.vertices_m[kept])
    way = unit(hand.bone_heads_m[0])
    assert (longer.vertices_m @ way).max() == pytest.approx(length_m, abs=0.001)
    grown = [volume_m3(m.vertices_m, triangles(m.quads)) for m in (hand, longer)]
    assert grown[1] > grown[0] * 1.1
    angles = open_hand(forearm_pronation=80.0)
    posed = [posed_hand(m, angles).vertices_m for m in (hand, longer)]
    np.testing.assert_allclose(posed[1][kept], posed[0][kept], atol=1e-6)
    assert posed[1][:, 1].min() == pytest.approx(-length_m, abs=0.002)


@pytest.mark.parametrize("length_m", [0.1, LONGEST_ARM_M + 0.1])
def test_an_arm_of_no_length_is_refused(hand: HandModel, length_m: float) -> None:
    with pytest.raises(ValueError, match=f"length_m is {length_m}"):
        with_arm(hand, length_m)
