"""Skin maps as Blender images: loaded once a process, whichever hand wants them."""

from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.skinmaps.store import MapLevel, load_skin_maps
from services.worker.scene.types import Camera

TEXELS_PER_M = {MapLevel.COARSE: 1500.0, MapLevel.MEDIUM: 3000.0, MapLevel.FINE: 6000.0}
"""About how many texels of a level lie along a metre of skin."""
MAGNIFIED = 1.35
"""A texel may be seen this many pixels wide before a finer level is worth its memory."""


@dataclass(frozen=True, eq=False)
class SkinImages:
    """The images of one hand, and its dorsum's pigment (N, 6) f4."""

    pigment: bpy.types.Image
    marks: bpy.types.Image
    relief: bpy.types.Image
    dorsum: npt.NDArray[np.float32]


@dataclass(frozen=True)
class SkinImageShelf:
    """Images by gender and level; the maps are compiled into `cache_dir` on first use."""

    cache_dir: Path
    loaded: dict[tuple[Gender, MapLevel], SkinImages] = field(default_factory=dict)

    def images(self, gender: Gender, level: MapLevel) -> SkinImages:
        """Return the images of a gender's skin at a level of detail."""
        key = (gender, level)
        if key not in self.loaded:
            files = load_skin_maps(gender, level, self.cache_dir)
            self.loaded[key] = SkinImages(
                _image(files.pigment), _image(files.marks), _image(files.relief), files.dorsum
            )
        return self.loaded[key]


def level_for(camera: Camera, keypoints_m: npt.NDArray[np.float64]) -> MapLevel:
    """Return the coarsest level whose texels are hardly wider than pixels where the hand is."""
    homogeneous = np.c_[keypoints_m, np.ones(len(keypoints_m))]
    depths_m = np.einsum("j,nj->n", camera.world_to_camera[2], homogeneous)
    pixels_per_m = camera.intrinsics.fx_px / max(float(np.median(depths_m)), 1e-3)
    for level in MapLevel:
        if pixels_per_m <= MAGNIFIED * TEXELS_PER_M[level]:
            return level
    return MapLevel.FINE


def _image(path: Path) -> bpy.types.Image:
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    return image
