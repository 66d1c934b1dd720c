"""Sections of a limb: how thick the skin is around an axis, by angle."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hi5_common.domain.errors import PermanentError
from services.worker.hand.rotation import unit
from services.worker.ornaments.mesh import F8, I4

ANGLES = 72
MIN_CROSSINGS = 12


class OrnamentUnfit(PermanentError):
    """A limb has no closed outline where an ornament should sit."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A place on a limb: origin (3,), the limb's axis (3,) distal, across (3,) and up (3,), unit.

    Angles run from `across` towards `up`.
    """

    origin_m: F8
    axis: F8
    across: F8
    up: F8

    @classmethod
    def of(cls, origin_m: F8, axis: F8, up: F8) -> "Frame":
        """Make up square to the axis; across = up × axis."""
        way = unit(axis)
        upright = unit(up - (up @ way) * way)
        return cls(origin_m, way, np.cross(upright, way), upright)

    def moved(self, along_m: float, across_m: float = 0.0, up_m: float = 0.0) -> "Frame":
        """Return the frame shifted along its own directions."""
        shift = along_m * self.axis + across_m * self.across + up_m * self.up
        return Frame(self.origin_m + shift, self.axis, self.across, self.up)

    def points(self, along_m: F8, across_m: F8, up_m: F8) -> F8:
        """Return points (..., 3) at coordinates (...) in this frame."""
        coordinates = np.stack(np.broadcast_arrays(across_m, up_m, along_m), axis=-1)
        axes = np.stack([self.across, self.up, self.axis])
        placed: F8 = np.einsum("...i,ij->...j", coordinates, axes) + self.origin_m
        return placed

    def around(self, along_m: npt.ArrayLike, radii_m: F8) -> F8:
        """Return points (..., 3) at even angles over the last axis of radii_m (..., N)."""
        turn = even_angles(radii_m.shape[-1])
        along = np.asarray(along_m, np.float64)
        return self.points(along, radii_m * np.cos(turn), radii_m * np.sin(turn))


def even_angles(count: int) -> F8:
    """Return `count` angles from 0 to just under 2 pi."""
    angles: F8 = 2.0 * np.pi * np.arange(count) / count
    return angles


@dataclass(frozen=True, eq=False)
class Limb:
    """Skin of one segment: vertices_m (W, 3) of the whole hand, quads (G, 4) of the segment."""

    vertices_m: F8
    quads: I4

    @classmethod
    def of(cls, vertices_m: F8, quads: I4, belongs: npt.NDArray[np.bool_]) -> "Limb":
        """Keep the quads whose corners all belong: (W,)."""
        return cls(vertices_m, quads[belongs[quads].all(axis=1)])

    def crossings(self, frame: Frame, along_m: float) -> F8:
        """Return (N, 2) across and up where the skin's edges pass a plane across the axis."""
        corners = self.vertices_m[self.quads] - frame.origin_m
        side = np.einsum("qck,k->qc", corners, frame.axis) - along_m
        after = np.roll(side, -1, axis=1)
        quad, corner = np.nonzero((side < 0) != (after < 0))
        start, end = corners[quad, corner], corners[quad, (corner + 1) % 4]
        share = side[quad, corner] / (side[quad, corner] - after[quad, corner])
        points = start + share[:, None] * (end - start)
        plane = np.stack([frame.across, frame.up])
        seen: F8 = np.einsum("nk,ik->ni", points, plane)
        return seen

    def centred(self, frame: Frame, along_m: float = 0.0) -> Frame:
        """Return the frame shifted along and into the middle of the section there."""
        points = self._outline_points(frame, along_m)
        across, up = ((points.max(axis=0) + points.min(axis=0)) / 2.0).tolist()
        return frame.moved(along_m, across, up)

    def radii_m(self, frame: Frame, along_m: float, count: int = ANGLES) -> F8:
        """Return how far the skin is from the axis at even angles, (count,)."""
        points = self._outline_points(frame, along_m)
        angle = np.arctan2(points[:, 1], points[:, 0])
        order = np.argsort(angle, kind="stable")
        reach = np.hypot(points[:, 0], points[:, 1])
        radii: F8 = np.interp(even_angles(count), angle[order], reach[order], period=2.0 * np.pi)
        return radii

    def _outline_points(self, frame: Frame, along_m: float) -> F8:
        points = self.crossings(frame, along_m)
        if len(points) < MIN_CROSSINGS:
            raise OrnamentUnfit(f"No skin {along_m * 1000:.0f} mm along the limb's axis.")
        return points


def rounded(radii_m: F8, harmonics: int) -> F8:
    """Return radii (..., N) without what changes faster than `harmonics` times around."""
    spectrum = np.fft.rfft(radii_m, axis=-1)
    spectrum[..., harmonics + 1 :] = 0.0
    smooth: F8 = np.fft.irfft(spectrum, radii_m.shape[-1], axis=-1)
    return smooth


def taut(radii_m: F8) -> F8:
    """Return the radii (N,) of a band pulled tight about an outline: its convex hull."""
    count = len(radii_m)
    turn = even_angles(count)
    corners = np.array(_hull(np.stack([radii_m * np.cos(turn), radii_m * np.sin(turn)], axis=1)))
    following = np.roll(corners, -1)
    place = np.searchsorted(corners, np.arange(count), side="right") - 1
    start, end = corners[place], following[place]
    before, after = turn - turn[start], turn[end] - turn
    a, b = radii_m[start], radii_m[end]
    chord = a * np.sin(before) + b * np.sin(after)
    tight: F8 = a * b * np.sin(before + after) / chord
    return np.maximum(tight, radii_m)


def _hull(points: F8) -> list[int]:
    """Return the rows, ascending, of the hull's corners of points (N, 2) in order of angle.

    The points wind once about the origin, which is inside; the scan of Graham (1972) from the
    furthest point, which is a corner.
    """
    count = len(points)
    first = int(np.argmax((points**2).sum(axis=1)))
    hull: list[int] = []
    for row in [*((first + step) % count for step in range(count)), first]:
        while len(hull) > 1 and _turns_right(points[hull[-2]], points[hull[-1]], points[row]):
            hull.pop()
        hull.append(row)
    return sorted(hull[:-1])


def _turns_right(a: F8, b: F8, c: F8) -> bool:
    return bool((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0)
