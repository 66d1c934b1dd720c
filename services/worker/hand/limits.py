"""Hard limits of the joint angles: what no healthy hand reaches."""

import numpy as np
import numpy.typing as npt

from services.worker.hand.angles import ANGLE_INDEX, ANGLE_NAMES, JointAngles

F8 = npt.NDArray[np.float64]

_FINGER = {"mcp_flex": (-45.0, 100.0), "pip_flex": (-10.0, 120.0), "dip_flex": (-15.0, 95.0)}
_ABDUCTION = {
    "index": (-12.0, 28.0),
    "middle": (-15.0, 15.0),
    "ring": (-10.0, 24.0),
    "pinky": (-16.0, 55.0),
}
_OTHER = {
    "thumb_cmc_azimuth": (-25.0, 95.0),
    "thumb_cmc_palmar_abd": (-5.0, 71.0),
    "thumb_cmc_pronation": (-20.0, 60.0),
    "thumb_mcp_flex": (-15.0, 70.0),
    "thumb_ip_flex": (-45.0, 90.0),
    "cmc4_flex": (0.0, 20.0),
    "cmc5_flex": (0.0, 28.0),
    "wrist_flex": (-86.0, 93.0),
    "wrist_ulnar_dev": (-25.0, 41.0),
    "forearm_pronation": (-96.0, 92.0),
}
FLEXED_MCP_DEG = 60.0
"""Beyond this flexion the collateral ligaments are tight and hold the finger sideways."""
FLEXED_MCP_ABDUCTION_DEG = 8.0


def _table() -> dict[str, tuple[float, float]]:
    table = dict(_OTHER)
    for finger, abduction in _ABDUCTION.items():
        table |= {f"{finger}_{joint}": limits for joint, limits in _FINGER.items()}
        table[f"{finger}_mcp_abd"] = abduction
    return table


HARD_LIMITS_DEG: F8 = np.array([_table()[name] for name in ANGLE_NAMES])
"""(26,2) lowest and highest angle (AAOS, AMA and e-hand norms with the margins of measured
populations)."""


def hard_limits_deg(angles: JointAngles) -> F8:
    """(26,2) lowest and highest angle in degrees, given the others: a flexed knuckle is held."""
    limits = HARD_LIMITS_DEG.copy()
    for finger in _ABDUCTION:
        if getattr(angles, f"{finger}_mcp_flex") > FLEXED_MCP_DEG:
            row = ANGLE_INDEX[f"{finger}_mcp_abd"]
            tight = (-FLEXED_MCP_ABDUCTION_DEG, FLEXED_MCP_ABDUCTION_DEG)
            limits[row] = np.clip(limits[row], *tight)
    return limits


def hard_limit_excess_deg(angles: JointAngles) -> F8:
    """(26,) degrees outside the hard limits: negative below, positive above, 0 inside."""
    values = angles.as_array()
    limits = hard_limits_deg(angles)
    excess: F8 = values - np.clip(values, limits[:, 0], limits[:, 1])
    return excess
