"""The 26 joint angles of a hand."""

from dataclasses import astuple, dataclass, fields

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class JointAngles:
    """Absolute anatomical angles in degrees, named as the columns of the pose table.

    Flexion is positive towards the palm. Abduction is positive away from the middle finger, for
    the middle finger positive towards the thumb. Thumb: azimuth of the metacarpal radial of the
    middle-finger axis, palmar abduction out of the palm plane, axial pronation from rest. Wrist:
    flexion positive, ulnar deviation positive. Forearm: 0 = thumb up with the forearm level,
    +80 = palm down, -80 = palm up.
    """

    index_mcp_flex: float
    index_mcp_abd: float
    index_pip_flex: float
    index_dip_flex: float
    middle_mcp_flex: float
    middle_mcp_abd: float
    middle_pip_flex: float
    middle_dip_flex: float
    ring_mcp_flex: float
    ring_mcp_abd: float
    ring_pip_flex: float
    ring_dip_flex: float
    pinky_mcp_flex: float
    pinky_mcp_abd: float
    pinky_pip_flex: float
    pinky_dip_flex: float
    thumb_cmc_azimuth: float
    thumb_cmc_palmar_abd: float
    thumb_cmc_pronation: float
    thumb_mcp_flex: float
    thumb_ip_flex: float
    cmc4_flex: float
    cmc5_flex: float
    wrist_flex: float
    wrist_ulnar_dev: float
    forearm_pronation: float

    def as_array(self) -> npt.NDArray[np.float64]:
        """(26,) degrees, in the order of ANGLE_NAMES."""
        return np.array(astuple(self), dtype=np.float64)

    @classmethod
    def from_array(cls, angles_deg: npt.NDArray[np.float64]) -> "JointAngles":
        """The inverse of as_array; ValueError unless the shape is (26,)."""
        if angles_deg.shape != (len(ANGLE_NAMES),):
            raise ValueError(f"expected {len(ANGLE_NAMES)} angles, got shape {angles_deg.shape}")
        return cls(*(float(angle) for angle in angles_deg))


ANGLE_NAMES: tuple[str, ...] = tuple(field.name for field in fields(JointAngles))
ANGLE_INDEX: dict[str, int] = {name: index for index, name in enumerate(ANGLE_NAMES)}
