"""What bending does to the flesh beside turning it: drivers of the corrective shapes."""

import numpy as np

from services.worker.hand.angles import JointAngles
from services.worker.hand.bones import FINGERS
from services.worker.hand.maps import smoothstep
from services.worker.hand.model import F8, HandModel

KNUCKLE_DEG = (25.0, 90.0)
"""MCP flexion over which the head of a metacarpal comes out."""
AZIMUTH_DEG = (50.0, 0.0)
"""Thumb azimuth over which its ball bunches: from the side of the palm to across it."""


def corrective_shares(angles: JointAngles) -> F8:
    """Share (5,) 0..1 of each of flesh.CORRECTIVES in a pose."""
    flexion = np.array([getattr(angles, f"{finger}_mcp_flex") for finger in FINGERS])
    across = AZIMUTH_DEG[0] - angles.thumb_cmc_azimuth
    bunched = smoothstep(0.0, AZIMUTH_DEG[0] - AZIMUTH_DEG[1], np.array([across]))
    return np.concatenate([smoothstep(*KNUCKLE_DEG, flexion), bunched])


def corrected_m(model: HandModel, angles: JointAngles) -> F8:
    """The skin (V,3) at rest, with the bulges that this pose will bring out."""
    shift: F8 = np.einsum("c,cvk->vk", corrective_shares(angles), model.correctives_m)
    return model.vertices_m + shift
