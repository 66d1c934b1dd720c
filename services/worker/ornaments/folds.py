"""The relief of a sleeve's cloth, as heights over its plain tube."""

import numpy as np

from hi5_common.domain.seeding import factor_rng
from services.worker.ornaments.mesh import F8
from services.worker.ornaments.section import even_angles
from services.worker.ornaments.worn import SleeveWorn

ANGLES = 96
FOLDS = 30


def eased(share: F8) -> F8:
    """Return 0 below 0, 1 above 1, smooth between."""
    clipped = np.clip(share, 0.0, 1.0)
    smooth: F8 = clipped * clipped * (3.0 - 2.0 * clipped)
    return smooth


def folds(sleeve: SleeveWorn, depth: F8) -> F8:
    """Return (K, ANGLES) ridges and troughs: short waves, aslant, each on a patch of its own.

    Sharpened towards ridges, as cloth buckles: wide troughs between narrow folds.
    """
    rng = factor_rng(sleeve.fold_seed, 0, "sleeve/folds")
    turn = even_angles(ANGLES)
    place = depth[:, None]
    total = np.zeros((len(depth), ANGLES))
    for _ in range(FOLDS):
        wave_m = float(rng.uniform(0.03, 0.09))
        slant = int(rng.choice((-3, -2, -1, 1, 2, 3)))
        bend = 0.6 * np.sin(turn + rng.uniform(0.0, 6.3))
        phase = place * 2.0 * np.pi / wave_m + slant * turn + bend + rng.uniform(0.0, 6.3)
        middle_m = sleeve.cuff_m + float(rng.uniform(0.0, 0.42))
        here = np.exp(-(((place - middle_m) / rng.uniform(0.02, 0.05)) ** 2))
        side = (0.5 + 0.5 * np.cos(turn - rng.uniform(0.0, 6.3))) ** rng.uniform(1.0, 4.0)
        ridge = ((1.0 + np.sin(phase)) / 2.0) ** 2.5
        total += float(rng.uniform(0.4, 1.3)) * here * side * (ridge - 0.3)
    drape = 0.3 * np.sin(turn + rng.uniform(0.0, 6.3) + 8.0 * place)
    calm = np.exp(-np.clip(place - 0.4, 0.0, None) / 0.15)
    relief: F8 = sleeve.fold_m * (total + drape) * calm
    return relief


def pleats(sleeve: SleeveWorn, beyond: F8) -> F8:
    """Return (K, ANGLES) small folds along the arm where a cuff gathers the sleeve."""
    rng = factor_rng(sleeve.fold_seed, 0, "sleeve/pleats")
    turn = even_angles(ANGLES)
    waves = sum(
        rng.uniform(0.3, 1.0) * np.sin(count * turn + rng.uniform(0.0, 6.3))
        for count in (7, 10, 13)
    )
    here = np.where(beyond > 0, np.exp(-np.clip(beyond, 0.0, None) / 0.018), 0.0)
    rise = np.clip(beyond / 0.004, 0.0, 1.0)
    relief: F8 = 0.0008 * (here * rise)[:, None] * waves
    return relief


def ribs(sleeve: SleeveWorn, beyond: F8) -> F8:
    """Return (K, ANGLES) the ribs of a knitted cuff."""
    cloth = sleeve.material.cloth
    knitted = cloth is not None and cloth.knitted
    here = 0.0006 * knitted * eased(-beyond / 0.004)[:, None]
    relief: F8 = here * np.cos(even_angles(ANGLES) * ANGLES / 4.0 + 0.6)
    return relief
