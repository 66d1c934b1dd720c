"""A ring on the proximal phalanx: a band of metal, and a stone if it has one."""

import numpy as np

from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import F8, OrnamentMesh, OrnamentName, Surface
from services.worker.ornaments.profile import hoop, oblong, sphere, turned
from services.worker.ornaments.section import ANGLES, Frame, Limb, rounded
from services.worker.ornaments.worn import RingWorn, Stone, StoneWorn

HARMONICS = 4
"""A band is round or a rounded square at most: what is bumpier is flesh that it presses."""
SUNK_M = 0.0004
FACETS = 8


def ring_meshes(ring: RingWorn, limbs: PosedLimbs) -> list[OrnamentMesh]:
    """Fit a ring to the posed finger."""
    frame, finger = limbs.phalanx(ring.finger, ring.along)
    inner = fitted_radii_m(finger, frame, ring.width_m) - SUNK_M
    profile = oblong(ring.width_m / 2.0, ring.thickness_m / 2.0, 3.0)
    profile = profile + np.array([0.0, ring.thickness_m / 2.0])
    meshes = [hoop(frame, np.tile(inner, (len(profile), 1)), profile).of(_RING, ring.metal)]
    if ring.stone is not None:
        top = inner[ANGLES // 4] + ring.thickness_m
        meshes += _stone_meshes(ring, ring.stone, frame.moved(0.0, 0.0, float(top)))
    return meshes


def fitted_radii_m(finger: Limb, frame: Frame, width_m: float) -> F8:
    """Return the radii (ANGLES,) of a rounded hoop on the skin across the band's width."""
    stations = width_m * np.array([-0.5, 0.0, 0.5])
    radii = np.stack([finger.radii_m(frame, float(along)) for along in stations])
    return rounded(radii.mean(axis=0), HARMONICS)


_RING = OrnamentName.RING


def _stone_meshes(ring: RingWorn, stone: StoneWorn, frame: Frame) -> list[OrnamentMesh]:
    """Return the setting and the stone, on the top of the band where the frame's origin is."""
    radius = stone.radius_m
    seat = turned(frame, radius * _SEAT[stone.cut], 20).of(_RING, ring.metal)
    return [seat, _cut(stone, frame).of(_RING, stone.material, smooth=stone.cut != Stone.FACETED)]


def _cut(stone: StoneWorn, frame: Frame) -> Surface:
    radius = stone.radius_m
    if stone.cut is Stone.PEARL:
        return sphere(frame.moved(0.0, 0.0, 0.9 * radius).origin_m, radius, 13, 20)
    if stone.cut is Stone.CABOCHON:
        polar = np.linspace(0.0, np.pi, 11)
        dome = np.stack([np.sin(polar), 0.35 + 0.55 * np.cos(polar)], axis=1)
        dome[[0, -1], 0] = 0.0
        return turned(frame, radius * dome, 24)
    return turned(frame, radius * _BRILLIANT, FACETS)


_BRILLIANT = np.array([[0.0, 0.0], [0.95, 0.62], [1.0, 0.70], [0.58, 1.02], [0.0, 1.02]])
"""Pavilion, girdle, crown and table, by the radius."""

_SEAT = {
    Stone.FACETED: np.array(
        [[0.0, -0.5], [0.45, -0.45], [0.9, 0.42], [0.98, 0.55], [0.9, 0.6], [0.0, 0.2]]
    ),
    Stone.CABOCHON: np.array(
        [[0.0, -0.5], [0.9, -0.4], [1.1, 0.0], [1.12, 0.3], [1.04, 0.42], [0.9, 0.4], [0.0, 0.1]]
    ),
    Stone.PEARL: np.array([[0.0, -0.5], [0.4, -0.4], [0.6, 0.1], [0.55, 0.3], [0.0, 0.2]]),
}
