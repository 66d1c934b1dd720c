"""Rotations and rigid transforms in float64, as plain functions on arrays."""

import numpy as np

from services.worker.hand.asset import F8


def unit(vector: F8) -> F8:
    """The vector(s) (...,3) at length 1."""
    scaled: F8 = vector / np.linalg.norm(vector, axis=-1, keepdims=True)
    return scaled


def about(axis: F8, angle_deg: float) -> F8:
    """Rotation (3,3) by the right-hand rule about an axis (3,) of any length (Rodrigues)."""
    x, y, z = unit(axis)
    angle = np.radians(angle_deg)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: F8 = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return rotation


def swing(start: F8, end: F8) -> F8:
    """The smallest rotation (3,3) that takes direction start to direction end.

    ValueError for opposite directions: there is no smallest one.
    """
    a, b = unit(start), unit(end)
    axis = np.cross(a, b)
    if not axis.any():
        if a @ b < 0.0:
            raise ValueError(f"{start} and {end} are opposite: no turn between them is smallest.")
        return np.eye(3)
    return about(axis, float(np.degrees(np.arctan2(np.linalg.norm(axis), a @ b))))


def around(centre: F8, rotation: F8) -> F8:
    """Rigid transform (4,4): the rotation about a fixed point (3,)."""
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = centre - rotation @ centre
    return transform


def angle_about_deg(axis: F8, start: F8, end: F8) -> float:
    """Signed angle from start to end seen along the unit axis, both projected off it."""
    dot = start @ end - (axis @ start) * (axis @ end)
    return float(np.degrees(np.arctan2(axis @ np.cross(start, end), dot)))


def quaternions(rotations: F8) -> F8:
    """Unit quaternions (B,4) as w, x, y, z of rotations (B,3,3) (Bar-Itzhack's largest term)."""
    m = rotations
    d = np.stack([m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]], axis=1)
    trace = d.sum(axis=1)
    table = np.empty((len(m), 4, 4))
    table[:, 0, 0] = 1.0 + trace
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        table[:, i + 1, i + 1] = 1.0 + 2.0 * d[:, i] - trace
        table[:, 0, i + 1] = table[:, i + 1, 0] = m[:, k, j] - m[:, j, k]
        table[:, j + 1, k + 1] = table[:, k + 1, j + 1] = m[:, j, k] + m[:, k, j]
    best = np.argmax(table[:, range(4), range(4)], axis=1)
    return unit(table[np.arange(len(m)), best])


def matrices(quaternion: F8) -> F8:
    """Rotations (N,3,3) of unit quaternions (N,4)."""
    w, x, y, z = np.moveaxis(quaternion, 1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)
