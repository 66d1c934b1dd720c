"""One hand's skin as Blender images: mixed from the maps for each hand, which are loaded once."""

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.skinmaps.maps import SkinMaps
from services.worker.hand.skinmaps.store import MapLevel, load_skin_maps
from services.worker.render.detail import Detail
from services.worker.scene.skin_paint import SkinPicture, painted
from services.worker.scene.types import Skin


@dataclass(frozen=True, eq=False)
class SkinImages:
    """The images of one hand: see SkinPicture."""

    albedo: bpy.types.Image
    relief: bpy.types.Image


@dataclass(frozen=True)
class Wanted:
    """What a hand's pictures are made of."""

    skin: Skin
    gender: Gender
    detail: Detail


@dataclass(eq=False)
class SkinImageShelf:
    """Maps by gender and level, compiled into `cache_dir` on first use, and the last hand's images.

    Cycles keeps an image's pixels for as long as the image lives, so every hand gets new ones.
    """

    cache_dir: Path
    maps: dict[tuple[Gender, MapLevel], Future[SkinMaps]] = field(default_factory=dict)
    shown: SkinImages | None = None
    expected: tuple[Wanted, SkinPicture] | None = None
    _beside: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1))

    def fetch(self, gender: Gender, level: MapLevel) -> Future[SkinMaps]:
        """Begin to load maps, compiling them where they are missing, unless they are here.

        What failed is tried again.
        """
        key = (gender, level)
        begun = self.maps.get(key)
        if begun is None or (begun.done() and begun.exception() is not None):
            self.maps[key] = self._beside.submit(load_skin_maps, gender, level, self.cache_dir)
        return self.maps[key]

    def images(self, skin: Skin, gender: Gender, detail: Detail) -> SkinImages:
        """Return new images of a skin. The ones before are kept until `show` is called."""
        wanted = Wanted(skin, gender, detail)
        ready, self.expected = self.expected, None
        picture = ready[1] if ready and ready[0] == wanted else self._mixed(wanted)
        return SkinImages(_image("albedo", picture.albedo), _image("relief", picture.relief))

    def expect(self, skin: Skin, gender: Gender, detail: Detail) -> None:
        """Mix the pictures that will be asked for next; any thread may."""
        wanted = Wanted(skin, gender, detail)
        self.expected = (wanted, self._mixed(wanted))

    def _mixed(self, wanted: Wanted) -> SkinPicture:
        maps = self.fetch(wanted.gender, wanted.detail.level).result()
        return painted(wanted.skin, maps, wanted.detail.pattern)

    def show(self, images: SkinImages) -> None:
        """Remove the images shown before, now that the material has these."""
        before, self.shown = self.shown, images
        if before is not None:
            for image in (before.albedo, before.relief):
                bpy.data.images.remove(image)


def _image(name: str, pixels: npt.NDArray[np.float32]) -> bpy.types.Image:
    side_px = pixels.shape[0]
    image = bpy.data.images.new(name, side_px, side_px, alpha=True, float_buffer=True, is_data=True)
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    return image
