"""The rest pose measured on the mesh: hand frame, hinge axes, rest angles."""

import numpy as np
import numpy.typing as npt

from hi5_common.domain.errors import PermanentError
from services.worker.hand.angles import ANGLE_NAMES
from services.worker.hand.asset import F8, I4
from services.worker.hand.bones import BONE_INDEX, FINGERS
from services.worker.hand.rotation import angle_about_deg, unit

DIGITS = ("thumb", *FINGERS)
"""Row order of the hinge axes."""


class NailNotFound(PermanentError):
    """A fingernail could not be located on the hand mesh."""


def hand_frame(joints_m: dict[str, F8]) -> F8:
    """Rotation (3,3) from the asset's frame to the hand's: rows x ulnar, y distal, z dorsal.

    The palm plane is spanned by the knuckle line (MCP2 to MCP5) and the line from the wrist to
    MCP3; y is the middle finger's first phalanx laid into it.
    """
    mcp = {digit: joints_m[f"joint-r-finger-{digit}-1"] for digit in (2, 3, 5)}
    z = unit(np.cross(mcp[5] - mcp[2], mcp[3] - joints_m["joint-r-hand"]))
    phalanx = joints_m["joint-r-finger-3-2"] - mcp[3]
    y = unit(phalanx - z * (z @ phalanx))
    return np.stack([np.cross(y, z), y, z])


def nail_quads(uvs: F8, nail_mask: F8) -> npt.NDArray[np.bool_]:
    """Which quads (F,) have their UV centroid on a nail of the mask."""
    height, width = nail_mask.shape
    u, v = np.moveaxis(uvs.mean(axis=1), -1, 0)
    column = np.clip((u * width).astype(np.int64), 0, width - 1)
    row = np.clip(((1.0 - v) * height).astype(np.int64), 0, height - 1)
    on_nail: npt.NDArray[np.bool_] = nail_mask[row, column] > 0.5
    return on_nail


def nail_normals(vertices_m: F8, nails: I4, tails_m: F8) -> F8:
    """Unit mean normal (5,3) of the nail of each digit, thumb first.

    nails (N,4): the quads of all nails; each goes to the digit whose bone end is nearest.
    """
    corners = vertices_m[nails]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    tips = tails_m[[BONE_INDEX[f"{digit}_distal"] for digit in DIGITS]]
    distance = np.linalg.norm(corners.mean(axis=1)[:, None] - tips, axis=2)
    owner = np.argmin(distance, axis=1)
    if set(owner.tolist()) != set(range(len(DIGITS))):
        raise NailNotFound
    return unit(np.stack([normals[owner == digit].sum(axis=0) for digit in range(len(DIGITS))]))


def hinge_axes(heads_m: F8, tails_m: F8, nails: F8) -> F8:
    """Unit flexion axis (5,3) of each digit at rest; positive rotation bends to the palm.

    The bone rolls of the asset are no guide; the axis stands on the last phalanx and the nail.
    """
    rows = [BONE_INDEX[f"{digit}_distal"] for digit in DIGITS]
    return unit(np.cross(tails_m[rows] - heads_m[rows], -nails))


def azimuth_deg(direction: F8) -> float:
    """Angle in the palm plane from the middle-finger axis towards the thumb."""
    return float(np.degrees(np.arctan2(-direction[0], direction[1])))


def elevation_deg(direction: F8) -> float:
    """Angle out of the palm plane towards the palm."""
    return float(np.degrees(np.arctan2(-direction[2], np.hypot(direction[0], direction[1]))))


def rest_angles_deg(heads_m: F8, tails_m: F8, hinges: F8) -> F8:
    """(26,) absolute angles of the mesh at rest, in the order of ANGLE_NAMES."""
    way = {name: unit(tails_m[i] - heads_m[i]) for name, i in BONE_INDEX.items()}
    hinge = dict(zip(DIGITS, hinges, strict=True))
    angles = dict.fromkeys(ANGLE_NAMES, 0.0)
    for finger in FINGERS:
        proximal, middle, distal = (way[f"{finger}_{s}"] for s in ("proximal", "middle", "distal"))
        flat = unit(proximal * [1.0, 1.0, 0.0])
        side = 1.0 if finger in ("index", "middle") else -1.0
        angles[f"{finger}_mcp_flex"] = angle_about_deg(hinge[finger], flat, proximal)
        angles[f"{finger}_mcp_abd"] = side * azimuth_deg(proximal)
        angles[f"{finger}_pip_flex"] = angle_about_deg(hinge[finger], proximal, middle)
        angles[f"{finger}_dip_flex"] = angle_about_deg(hinge[finger], middle, distal)
    metacarpal, proximal, distal = (way[f"thumb_{s}"] for s in ("metacarpal", "proximal", "distal"))
    angles["thumb_cmc_azimuth"] = azimuth_deg(metacarpal)
    angles["thumb_cmc_palmar_abd"] = elevation_deg(metacarpal)
    angles["thumb_mcp_flex"] = angle_about_deg(hinge["thumb"], metacarpal, proximal)
    angles["thumb_ip_flex"] = angle_about_deg(hinge["thumb"], proximal, distal)
    angles["wrist_flex"] = -elevation_deg(way["forearm"])
    angles["wrist_ulnar_dev"] = azimuth_deg(way["forearm"])
    return np.array([angles[name] for name in ANGLE_NAMES])
