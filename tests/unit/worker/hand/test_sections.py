"""A bent joint keeps its thickness and its width."""

from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.builds import HandFamily
from services.worker.hand.corrective import corrective_shares
from services.worker.hand.model import HandModel
from services.worker.hand.sections import JOINTS, Joint, bent, joint_size, open_hand, pressed_size
from services.worker.hand.shape import SHAPE_EXTREMES
from services.worker.hand.subdivide import Subdivision, subdivision

MOST = 0.12
SHAPES = dict(SHAPE_EXTREMES)


@pytest.fixture(scope="module")
def smooth(hands: dict[Gender, HandModel]) -> Subdivision:
    return subdivision(hands[Gender.MALE], 1)


def changes(hand: HandModel, smooth: Subdivision, joint: Joint, bend_deg: float) -> list[float]:
    """How thickness, width and volume changed, as shares."""
    rest, size = (joint_size(hand, smooth, joint, bent(joint, angle)) for angle in (0.0, bend_deg))
    width = 0.0 if joint.in_palm else size.width_m / rest.width_m - 1.0
    return [size.thickness_m / rest.thickness_m - 1.0, width, size.volume_m3 / rest.volume_m3 - 1.0]


@pytest.mark.parametrize("joint", JOINTS, ids=lambda joint: joint.name)
def test_a_bent_joint_keeps_its_size(joint: Joint, hand: HandModel, smooth: Subdivision) -> None:
    for bend_deg in (45.0, 90.0):
        thickness, width, volume = changes(hand, smooth, joint, bend_deg)
        assert abs(thickness) < MOST
        assert abs(width) < MOST
        assert abs(volume) < 0.02


@pytest.mark.parametrize("name", ["weight_high", "all_low", "all_high"])
def test_so_it_does_at_the_extremes_of_shape(
    name: str, families: dict[Gender, HandFamily], smooth: Subdivision
) -> None:
    hand = families[Gender.FEMALE].shaped(SHAPES[name])
    for joint in JOINTS[::2]:
        assert np.abs(changes(hand, smooth, joint, 90.0)).max() < MOST


@pytest.mark.parametrize("joint", JOINTS[::3], ids=lambda joint: joint.name)
def test_pressing_flesh_leaves_no_joint_thin(
    joint: Joint, hand: HandModel, smooth: Subdivision
) -> None:
    rest, size = (pressed_size(hand, smooth, joint, bent(joint, angle)) for angle in (0.0, 90.0))
    assert size.thickness_m > (1.0 - MOST) * rest.thickness_m


def test_knuckles_come_out_by_the_corrective_shapes_alone(
    hand: HandModel, smooth: Subdivision
) -> None:
    pinky = next(joint for joint in JOINTS if joint.name == "pinky_mcp_flex")
    flat = replace(hand, correctives_m=np.zeros_like(hand.correctives_m))
    thin, full = (changes(model, smooth, pinky, 90.0)[0] for model in (flat, hand))
    assert thin < full - 0.05


def test_correctives_rest_while_the_hand_is_open() -> None:
    assert not corrective_shares(open_hand()).any()
    shares = corrective_shares(replace(open_hand(), ring_mcp_flex=90.0, thumb_cmc_azimuth=0.0))
    np.testing.assert_allclose(shares, [0.0, 0.0, 1.0, 0.0, 1.0])
