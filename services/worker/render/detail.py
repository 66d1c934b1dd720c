"""How much of a skin a picture can hold: by how large the hand is in it, and by nothing else."""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from services.worker.hand.maps import smoothstep
from services.worker.hand.skinmaps.store import MapLevel
from services.worker.scene.types import Camera, HandScene, SceneGeometry

MOST_PX_PER_M = {
    MapLevel.TINY: 1800.0,
    MapLevel.COARSE: 3600.0,
    MapLevel.MEDIUM: 7200.0,
    MapLevel.FINE: math.inf,
}
"""How large a hand may be in the picture before a finer level is worth its cost. The levels have
about 750, 1500, 3000 and 6000 texels a metre, and a texel is seen up to 2.4 pixels wide: wider ones
make a stair of a nail's border and a grid of the folds over a knuckle. The next level takes seconds
to compile."""
PATTERN_PX_PER_M = (1000.0, 2400.0)
"""Lines a millimetre apart are lost where a millimetre is one pixel, and whole at 2.4 pixels."""
RELIEF_PX_PER_M = 700.0
"""Below this, a hand of 130 pixels, no fold of the skin is half a pixel wide."""


@dataclass(frozen=True)
class Detail:
    """The level of the maps, the share of fine pattern that is drawn, and whether relief is."""

    level: MapLevel
    pattern: float
    relief: bool


def finer(detail: Detail) -> Detail:
    """Return the same with the next finer maps, for what has hard edges: painted nails."""
    levels = list(MapLevel)
    return replace(detail, level=levels[min(levels.index(detail.level) + 1, len(levels) - 1)])


def detail_for(camera: Camera, keypoints_m: npt.NDArray[np.float64]) -> Detail:
    """Return what of the skin is worth drawing where the hand is.

    The level is the coarsest that a hand of this size allows.
    """
    size = pixels_per_m(camera, keypoints_m)
    level = next(level for level in MapLevel if size <= MOST_PX_PER_M[level])
    pattern = float(smoothstep(*PATTERN_PX_PER_M, np.array(size)))
    return Detail(level, pattern, size >= RELIEF_PX_PER_M)


def path_px(scene: HandScene, geometry: SceneGeometry) -> float:
    """Return the longest mean free path of light in a scene's skin, in pixels."""
    path_m = max(scene.skin.mean_free_path_mm) / 1000.0
    return path_m * pixels_per_m(scene.camera, geometry.keypoints_m)


def pixels_per_m(camera: Camera, keypoints_m: npt.NDArray[np.float64]) -> float:
    """Return how large a metre at the hand's middle depth is in the picture."""
    homogeneous = np.c_[keypoints_m, np.ones(len(keypoints_m))]
    depths_m = np.einsum("j,nj->n", camera.world_to_camera[2], homogeneous)
    return camera.intrinsics.fx_px / max(float(np.median(depths_m)), 1e-3)
