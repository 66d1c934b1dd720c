"""A sleeve over the forearm: a tube of cloth with a cuff, folds, and a far end out of sight."""

from dataclasses import dataclass, replace

import numpy as np

from services.worker.ornaments.folds import ANGLES, eased, folds, pleats, ribs
from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import F8, OrnamentMesh, OrnamentName, joined, torus
from services.worker.ornaments.profile import turned
from services.worker.ornaments.section import Frame, Limb, rounded
from services.worker.ornaments.worn import SleeveWorn

BUTTON_STEP_M = 0.017
_BUTTON = np.array(
    [
        *([0.0, -0.1], [0.9, -0.1], [1.0, 0.05], [1.0, 0.22]),
        *([0.9, 0.32], [0.78, 0.3], [0.7, 0.24], [0.0, 0.22]),
    ]
)
"""Radius and height of a button with a raised rim, by its radius."""
BEYOND_ELBOW_M = 0.6
ELBOW_MARGIN_M = 0.03
"""Sections are measured this far from the forearm's cut end, where the mesh is still an arm's."""
SECTIONS = 8
HARMONICS = 4
RINGS = 92
GATHERING_M = 0.007
WIDENING_M = 0.009
SEAM_DEPTH_M = 0.0005
SKIN_GAP_M = 0.0012
INSIDE_M = 0.05
"""How deep one sees into a sleeve; beyond, its inside is a plain tube."""


def sleeve_meshes(sleeve: SleeveWorn, limbs: PosedLimbs) -> list[OrnamentMesh]:
    """Fit a sleeve to the posed forearm, and the shirt under a jacket."""
    wrist, forearm = limbs.forearm()
    arm = _arm(forearm, wrist)
    meshes = _sewn(sleeve, arm)
    if sleeve.inner is not None:
        under = replace(
            sleeve,
            from_wrist_m=sleeve.from_wrist_m - 0.014,
            ease_m=0.45 * sleeve.ease_m,
            thickness_m=0.0011,
            cuff_m=0.05,
            fold_m=0.0004,
            seam_m=0.005,
            buttons=0,
            material=sleeve.inner,
        )
        meshes += _sewn(under, arm)
    return meshes


@dataclass(frozen=True, eq=False)
class _Arm:
    """Radii (S, ANGLES) of the skin about the frame's axis at S places (descending) along it."""

    frame: Frame
    along_m: F8
    radii_m: F8

    def at(self, along_m: F8) -> F8:
        """Return radii (K, ANGLES); beyond the last section those of the last one."""
        place = np.interp(-along_m, -self.along_m, np.arange(len(self.along_m)))
        below = np.minimum(place.astype(int), len(self.along_m) - 2)
        share = (place - below)[:, None]
        found: F8 = self.radii_m[below] * (1.0 - share) + self.radii_m[below + 1] * share
        return found


def _arm(forearm: Limb, wrist: Frame) -> _Arm:
    reach = forearm.vertices_m[forearm.quads.ravel()] @ wrist.axis
    end = float(reach.min()) + ELBOW_MARGIN_M
    along = np.linspace(-0.012, end, SECTIONS)
    frame = forearm.centred(wrist, float(along[2])).moved(-float(along[2]))
    radii = np.stack([forearm.radii_m(frame, float(place), ANGLES) for place in along])
    return _Arm(frame, along, radii)


@dataclass(frozen=True, eq=False)
class _Cloth:
    """The sleeve's inner radii (K, ANGLES) at K places along the arm's axis, the hem first."""

    along_m: F8
    inner_m: F8


def _sewn(sleeve: SleeveWorn, arm: _Arm) -> list[OrnamentMesh]:
    """Return the cloth and its buttons."""
    along = _stations(sleeve, arm)
    cloth = _Cloth(along, _inner_m(sleeve, arm, along, -along - sleeve.from_wrist_m))
    return [_tube(sleeve, arm, cloth), *_buttons(sleeve, arm, cloth)]


def _tube(sleeve: SleeveWorn, arm: _Arm, cloth: _Cloth) -> OrnamentMesh:
    """Return the cloth: outside, round the hem, and back inside."""
    along, inner = cloth.along_m, cloth.inner_m
    hem_along = -sleeve.from_wrist_m + 0.5 * sleeve.thickness_m
    hem = inner[:1] + 0.5 * sleeve.thickness_m
    seen = np.flatnonzero(-along - sleeve.from_wrist_m <= INSIDE_M).tolist()
    inside = [*seen, (seen[-1] + len(along) - 1) // 2, len(along) - 1]
    rings = np.concatenate([inner[::-1] + sleeve.thickness_m, hem, inner[inside]])
    places = np.concatenate([along[::-1], [hem_along], along[inside]])
    stuff = sleeve.material.cloth
    repeat_m = stuff.repeat_m if stuff is not None else 0.01
    # Whole repeats around, so that no seam shows.
    girth_m = max(round(2.0 * np.pi * float(hem.mean()) / repeat_m), 1) * repeat_m
    surface = torus(
        arm.frame.around(places[:, None], rings),
        np.linspace(0.0, girth_m, ANGLES + 1),
        -np.append(places, places[-1]),
    )
    return surface.of(OrnamentName.SLEEVE, sleeve.material)


def _buttons(sleeve: SleeveWorn, arm: _Arm, cloth: _Cloth) -> list[OrnamentMesh]:
    """Return the cuff's buttons, one behind the other."""
    column = round(sleeve.button_turn * ANGLES) % ANGLES
    pieces = []
    for number in range(sleeve.buttons):
        depth_m = sleeve.from_wrist_m + sleeve.buttons_at_m + number * BUTTON_STEP_M
        row = int(np.abs(cloth.along_m + depth_m).argmin())
        ring = arm.frame.around(cloth.along_m[row], cloth.inner_m[row] + sleeve.thickness_m)
        chord = ring[(column + 2) % ANGLES] - ring[column - 2]
        seat = Frame.of(ring[column], arm.frame.axis, np.cross(arm.frame.axis, chord))
        outward = seat.up @ (ring[column] - ring.mean(axis=0)) > 0
        seat = seat if outward else Frame.of(ring[column], arm.frame.axis, -seat.up)
        pieces.append(turned(seat, sleeve.button_radius_m * _BUTTON, 20))
    return [joined(pieces).of(OrnamentName.SLEEVE, sleeve.button)] if pieces else []


def _stations(sleeve: SleeveWorn, arm: _Arm) -> F8:
    """Return places (K,) along the axis from the hem on: dense near it, sparse beyond the elbow."""
    start, elbow = -sleeve.from_wrist_m, float(arm.along_m[-1])
    near = np.linspace(0.0, 1.0, RINGS - 18) ** 1.25
    hem = np.array([0.0, 0.0004, 0.0012])
    dense = start - np.concatenate([hem, near[1:] * (start - elbow)])
    return np.concatenate([dense, elbow - np.linspace(0.0, BEYOND_ELBOW_M, 18)[1:]])


def _inner_m(sleeve: SleeveWorn, arm: _Arm, along: F8, depth: F8) -> F8:
    """Return the inner radii (K, ANGLES): skin, ease, a stiff cuff with its seam, and folds."""
    skin = arm.at(along)
    # Cloth never narrows towards the elbow.
    shape = np.maximum.accumulate(rounded(skin, HARMONICS), axis=0)
    beyond = depth - sleeve.cuff_m
    loose = eased(beyond / GATHERING_M)[:, None]
    wider = WIDENING_M * eased(beyond / 0.22)[:, None]
    ease = sleeve.ease_m + loose * 0.6 * sleeve.fold_m + wider
    seam = -SEAM_DEPTH_M * np.exp(-(((depth - sleeve.seam_m) / 0.0011) ** 2))[:, None]
    stiff = 0.12 * eased(depth / max(sleeve.cuff_m, 1e-3))[:, None]
    relief = folds(sleeve, depth) * np.maximum(loose, stiff)
    gathers = pleats(sleeve, beyond) if sleeve.gathered else ribs(sleeve, beyond)
    lowest: F8 = np.maximum(shape + ease + seam + relief + gathers, skin + SKIN_GAP_M)
    return lowest
