"""The seam to a renderer: a resolved scene goes in, linear pixels of one rectangle come out."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender
from services.worker.render.rect import PixelRect
from services.worker.render.settings import RenderSettings
from services.worker.scene.types import Array, Camera, HandScene, SceneGeometry


@dataclass(frozen=True, eq=False)
class Frame:
    """The hand over nothing: rgba (region.height, region.width, 4) f4, linear sRGB primaries.

    Colour is premultiplied by alpha; no exposure and no view transform has been applied.
    phases_s: wall-clock seconds by phase, for tuning only.
    """

    rgba: npt.NDArray[np.float32]
    region: PixelRect
    phases_s: dict[str, float]


class Renderer(Protocol):
    """Draws a hand on the pixels of a rectangle."""

    def name_of(self, settings: RenderSettings) -> str:
        """Return the name that labels record of what draws with these settings."""
        ...

    @property
    def versions(self) -> dict[str, str]:
        """Versions of what draws, by component: with the same ones pixels are the same."""
        ...

    def prepare(self, gender: Gender, camera: Camera, keypoints_m: Array) -> None:
        """Begin what drawing a hand will need, or nothing; keypoints_m (21, 3) in the world."""
        ...

    def expect(self, scene: HandScene, geometry: SceneGeometry) -> None:
        """Make ready what the next frame will need, while another thread renders this one."""
        ...

    def render(
        self,
        scene: HandScene,
        geometry: SceneGeometry,
        region: PixelRect,
        settings: RenderSettings,
    ) -> Frame:
        """Return the frame of a non-empty region. Raise RenderFailed when there is none."""
        ...
