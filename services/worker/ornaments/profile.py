"""Shapes that ornaments are swept from."""

import numpy as np

from services.worker.hand.rotation import unit
from services.worker.ornaments.mesh import F8, Surface, ball, torus
from services.worker.ornaments.section import Frame, even_angles


def oblong(half_width_m: float, half_height_m: float, squareness: float, count: int = 12) -> F8:
    """Return (count, 2) points of a superellipse (Lamé): exponent 2 is round, 6 almost square."""
    turn = even_angles(count) + np.pi / count
    cosine, sine = np.cos(turn), np.sin(turn)
    power = 2.0 / squareness
    return np.stack(
        [
            half_width_m * np.sign(cosine) * np.abs(cosine) ** power,
            half_height_m * np.sign(sine) * np.abs(sine) ** power,
        ],
        axis=1,
    )


def hoop(frame: Frame, inner_m: F8, profile: F8) -> Surface:
    """Return a closed band about a frame's axis: inner_m (P, N) radii at the profile's points.

    profile (P, 2): along the axis, and outward from the inner radii.
    """
    radii = inner_m + profile[:, 1:]
    return torus(np.swapaxes(frame.around(profile[:, :1], radii), 0, 1))


def turned(frame: Frame, profile: F8, count: int) -> Surface:
    """Return a body turned about the frame's UP direction: profile (K, 2) of radius and height.

    The first and last radius are 0, so that it is closed.
    """
    turn = even_angles(count)
    radius, height = profile[:, :1], profile[:, 1:]
    points = frame.points(radius * np.cos(turn), radius * np.sin(turn), height + 0.0 * turn)
    return ball(points)


def tube(path_m: F8, radius_m: float, count: int = 8) -> Surface:
    """Return a tube about a closed path (K, 3)."""
    tangent = unit(np.roll(path_m, -1, axis=0) - np.roll(path_m, 1, axis=0))
    outward = path_m - path_m.mean(axis=0)
    side = unit(np.cross(tangent, outward))
    other = np.cross(side, tangent)
    turn = even_angles(count)[:, None, None]
    ring = path_m + radius_m * (np.cos(turn) * side + np.sin(turn) * other)
    return torus(np.swapaxes(ring, 0, 1))


def sphere(centre_m: F8, radius_m: float, rings: int = 9, count: int = 12) -> Surface:
    """Return a ball of quads about a point (3,)."""
    polar = np.linspace(0.0, np.pi, rings)[:, None]
    turn = even_angles(count)
    sine = np.sin(polar)
    points = [sine * np.cos(turn), sine * np.sin(turn), np.cos(polar) + 0.0 * turn]
    return ball(centre_m + radius_m * np.stack(points, axis=-1))


def block(frame: Frame, low_m: F8, high_m: F8, bevel_m: float) -> Surface:
    """Return a box with rounded edges between (along, across, up) coordinates in a frame."""
    middle, half = (low_m + high_m) / 2.0, (high_m - low_m) / 2.0
    quarter = bevel_m * (1.0 - np.sqrt(0.5))
    inset = np.array([bevel_m, bevel_m, quarter, 0.0, 0.0, quarter, bevel_m, bevel_m])
    lift = np.array([0.0, 0.0, quarter, bevel_m])
    height = np.concatenate([lift - half[2], half[2] - lift[::-1]])
    reach = half[:2] - inset[:, None]
    reach[[0, -1]] = 0.0  # poles
    corner = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]])
    along, across = (middle[k] + reach[:, k : k + 1] * corner[:, k] for k in (0, 1))
    return ball(frame.points(along, across, middle[2] + height[:, None] + 0.0 * along))
