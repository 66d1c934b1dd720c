from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.vocabulary import Pose
from services.worker.hand.angles import ANGLE_INDEX
from services.worker.hand.limits import hard_limit_excess_deg
from services.worker.scene.poses import pose_library

FIVE = pose_library()[Pose.FIVE]


@pytest.mark.parametrize("pose", list(Pose))
def test_every_pose_is_within_the_hard_limits(pose: Pose) -> None:
    assert not hard_limit_excess_deg(pose_library()[pose]).any()


@pytest.mark.parametrize(
    ("name", "angle_deg", "excess_deg"),
    [
        ("index_pip_flex", 125.0, 5.0),
        ("ring_dip_flex", -17.0, -2.0),
        ("thumb_cmc_palmar_abd", 72.5, 1.5),
        ("cmc5_flex", -1.0, -1.0),
        ("pinky_mcp_abd", 55.0, 0.0),
    ],
)
def test_excess_is_signed(name: str, angle_deg: float, excess_deg: float) -> None:
    excess = hard_limit_excess_deg(replace(FIVE, **{name: angle_deg}))
    assert excess[ANGLE_INDEX[name]] == excess_deg
    assert np.count_nonzero(excess) == (excess_deg != 0.0)


def test_a_flexed_knuckle_is_held_sideways() -> None:
    spread = replace(FIVE, ring_mcp_flex=61.0, ring_mcp_abd=11.0)
    assert hard_limit_excess_deg(spread)[ANGLE_INDEX["ring_mcp_abd"]] == 3.0
    assert not hard_limit_excess_deg(replace(spread, ring_mcp_flex=60.0)).any()
