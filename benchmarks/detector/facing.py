"""Which side of the hand a picture shows, and from how far: what the found share depends on."""

import numpy as np

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.vocabulary import KEYPOINTS, Attribute, Handedness

EDGE_BELOW = 0.5
"""Cosine between the palm's normal and the way to the camera: within 30° of edge on."""
WRIST, FORE, PINKY = (KEYPOINTS.index(n) for n in ("wrist", "forefinger1", "pinky_finger1"))
KNUCKLES = [KEYPOINTS.index(f"{n}_finger1") for n in ("middle", "ring")] + [WRIST, FORE, PINKY]
NEAR_M = (0.25, 0.35, 0.5)
"""Distances that part near views from far ones."""


def distance(label: ImageLabel) -> str:
    """Return the range that the hand's distance from the camera lies in, metres."""
    if label.keypoints is None:
        raise ValueError(f"{label.file_name} has no keypoints.")
    away_m = float(np.median(np.array([point.camera_m for point in label.keypoints])[:, 2]))
    for nearer_m in NEAR_M:
        if away_m < nearer_m:
            return f"under {nearer_m} m"
    return f"{NEAR_M[-1]} m or more"


def facing(label: ImageLabel) -> str:
    """Return whether the camera sees palm, back or edge of the plane of wrist and knuckles."""
    if label.keypoints is None:
        raise ValueError(f"{label.file_name} has no keypoints.")
    points = np.array([point.camera_m for point in label.keypoints])
    palmar = np.cross(points[FORE] - points[WRIST], points[PINKY] - points[WRIST])
    if label.attributes[Attribute.HANDEDNESS] == Handedness.LEFT:
        palmar = -palmar
    towards_camera = -points[KNUCKLES].mean(axis=0)
    lengths = np.linalg.norm(palmar) * np.linalg.norm(towards_camera)
    cosine = float((palmar * towards_camera).sum() / lengths)
    if abs(cosine) < EDGE_BELOW:
        return "edge"
    return "palm" if cosine > 0 else "back"
