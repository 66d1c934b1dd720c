"""A sleeve over the forearm: a tube of cloth with a cuff, folds, and a far end out of sight."""

from dataclasses import dataclass, replace

import numpy as np

from hi5_common.domain.seeding import factor_rng
from services.worker.ornaments.limbs import PosedLimbs
from services.worker.ornaments.mesh import F8, OrnamentMesh, OrnamentName, torus
from services.worker.ornaments.section import ANGLES, Frame, Limb, even_angles, rounded
from services.worker.ornaments.worn import SleeveWorn

BEYOND_ELBOW_M = 0.6
ELBOW_MARGIN_M = 0.03
"""Sections are measured this far from the forearm's cut end, where the mesh is still an arm's."""
SECTIONS = 8
HARMONICS = 4
RINGS = 96
FOLDS = 26
CUFF_STEP_M = 0.003
SKIN_GAP_M = 0.0012
INSIDE_M = 0.05
"""How deep one sees into a sleeve; beyond, its inside is a plain tube."""


def sleeve_meshes(sleeve: SleeveWorn, limbs: PosedLimbs) -> list[OrnamentMesh]:
    """Fit a sleeve to the posed forearm, and the shirt under a jacket."""
    wrist, forearm = limbs.forearm()
    arm = _arm(forearm, wrist)
    meshes = [_tube(sleeve, arm)]
    if sleeve.inner is not None:
        under = replace(
            sleeve,
            from_wrist_m=sleeve.from_wrist_m - 0.014,
            ease_m=0.45 * sleeve.ease_m,
            thickness_m=0.0011,
            cuff_m=0.05,
            fold_m=0.0004,
            material=sleeve.inner,
        )
        meshes.append(_tube(under, arm))
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
    radii = np.stack([forearm.radii_m(frame, float(place)) for place in along])
    return _Arm(frame, along, radii)


def _tube(sleeve: SleeveWorn, arm: _Arm) -> OrnamentMesh:
    """Return the cloth: outside, round the hem, and back inside."""
    along = _stations(sleeve, arm)
    depth = -along - sleeve.from_wrist_m
    inner = _inner_m(sleeve, arm, along, depth)
    outer = inner + sleeve.thickness_m
    hem_along = -sleeve.from_wrist_m + 0.5 * sleeve.thickness_m
    hem = inner[:1] + 0.5 * sleeve.thickness_m
    inside = [row for row in range(len(along)) if depth[row] <= INSIDE_M]
    inside += [(inside[-1] + len(along) - 1) // 2, len(along) - 1]
    rings = np.concatenate([outer[::-1], hem, inner[inside]])
    places = np.concatenate([along[::-1], [hem_along], along[inside]])
    cloth = sleeve.material.cloth
    repeat_m = cloth.repeat_m if cloth is not None else 0.01
    # Whole repeats around, so that no seam shows.
    girth_m = max(round(2.0 * np.pi * float(hem.mean()) / repeat_m), 1) * repeat_m
    surface = torus(
        arm.frame.around(places[:, None], rings),
        np.linspace(0.0, girth_m, ANGLES + 1),
        -np.append(places, places[-1]),
    )
    return surface.of(OrnamentName.SLEEVE, sleeve.material)


def _stations(sleeve: SleeveWorn, arm: _Arm) -> F8:
    """Return places (K,) along the axis from the hem on: dense near it, sparse beyond the elbow."""
    start, elbow = -sleeve.from_wrist_m, float(arm.along_m[-1])
    near = np.linspace(0.0, 1.0, RINGS - 18) ** 1.25
    hem = np.array([0.0, 0.0004, 0.0012])
    dense = start - np.concatenate([hem, near[1:] * (start - elbow)])
    return np.concatenate([dense, elbow - np.linspace(0.0, BEYOND_ELBOW_M, 18)[1:]])


def _inner_m(sleeve: SleeveWorn, arm: _Arm, along: F8, depth: F8) -> F8:
    """Return the inner radii (K, ANGLES): skin, ease, what the cuff gathers, and folds."""
    skin = arm.at(along)
    shape = rounded(skin, HARMONICS)
    shape = np.maximum.accumulate(shape, axis=0)  # cloth never narrows towards the elbow
    past = np.clip(depth / sleeve.cuff_m, 0.0, 1.0)[:, None]
    loose = np.clip((depth - sleeve.cuff_m) / 0.02, 0.0, 1.0)[:, None]
    loose = loose * loose * (3.0 - 2.0 * loose)
    wide = np.clip((depth - sleeve.cuff_m) / 0.25, 0.0, 1.0)[:, None]
    ease = sleeve.ease_m * (0.75 + 0.25 * past) + loose * sleeve.fold_m + 0.02 * wide
    folds = _folds(sleeve, along, float(shape.mean()))
    stiff = np.clip(depth / max(sleeve.cuff_m, 1e-3), 0.0, 1.0)[:, None] ** 2 * 0.25
    radii = shape + ease + folds * np.maximum(loose, stiff)
    lowest: F8 = np.maximum(radii, skin + SKIN_GAP_M)
    return lowest


def _folds(sleeve: SleeveWorn, along: F8, radius_m: float) -> F8:
    """Return (K, ANGLES) ridges and troughs: waves that run around more than along, in patches.

    Sharpened towards ridges, as cloth buckles: wide troughs between narrow folds.
    """
    rng = factor_rng(sleeve.fold_seed, 0, "sleeve/folds")
    turn = even_angles(ANGLES)
    total = np.zeros((len(along), ANGLES))
    for _ in range(FOLDS):
        wave_m = float(rng.uniform(0.018, 0.055))
        slant = int(rng.integers(-2, 3))
        phase = -along[:, None] * 2.0 * np.pi / wave_m + slant * turn + rng.uniform(0.0, 6.3)
        middle_m, reach_m = float(rng.uniform(0.02, 0.45)), float(rng.uniform(0.02, 0.07))
        here = np.exp(-(((-along[:, None] - middle_m) / reach_m) ** 2))
        side = 0.5 + 0.5 * np.cos(turn - rng.uniform(0.0, 6.3))
        ridge = ((1.0 + np.sin(phase)) / 2.0) ** 2.2
        total += float(rng.uniform(0.3, 1.0)) * here * side**1.5 * (ridge - 0.35)
    drape = np.sin(2.0 * turn + rng.uniform(0.0, 6.3)) * 0.25
    calm = np.exp(-np.clip(-along[:, None] - 0.35, 0.0, None) / 0.2)
    folds: F8 = sleeve.fold_m * (total + drape) * calm * min(radius_m / 0.035, 1.3)
    return folds
