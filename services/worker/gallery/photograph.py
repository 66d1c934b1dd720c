"""From a sitting to its picture: the same renderer and the same pixels as a dataset's."""

from dataclasses import dataclass

import numpy as np

from hi5_common.domain.spec import Quality
from services.worker.compose.picture import (
    F4,
    U1,
    Outline,
    compose_picture,
    lay_backdrop,
    outlined,
    over,
    to_srgb8,
)
from services.worker.gallery.scenes import Sitting, scene_of
from services.worker.label.outline import coverage
from services.worker.label.projected import project_mesh
from services.worker.label.raster import rasterise
from services.worker.label.region import touched_region
from services.worker.render.checks import check_frame
from services.worker.render.port import Frame, Renderer
from services.worker.render.settings import QUALITY_SETTINGS
from services.worker.scene.environments import load_panorama
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary

GREY = 0.42
"""Linear display level of the plain ground: as light skin, so that neither end of tones drowns."""


@dataclass(frozen=True)
class Photographer:
    """Takes the gallery's pictures."""

    renderer: Renderer
    hands: HandLibrary
    quality: Quality

    def take(self, sitting: Sitting) -> U1:
        """Return the (H, W, 3) sRGB picture of a sitting."""
        scene = scene_of(sitting, self.hands)
        geometry = build_geometry(scene, self.hands)
        mesh = project_mesh(scene.camera, geometry)
        region = touched_region(mesh)
        outline = Outline(region, coverage(rasterise(mesh), region))
        frame = self.renderer.render(scene, geometry, region, QUALITY_SETTINGS[self.quality])
        check_frame(frame, scene.light.exposure_ev)
        if sitting.in_place:
            backdrop = lay_backdrop(scene, outline, load_panorama(scene.light.environment))
            return compose_picture(scene, frame, outline, backdrop)
        return to_srgb8(_on_grey(frame, outline, sitting.side_px, scene.light.gain))


def _on_grey(frame: Frame, outline: Outline, side_px: int, gain: F4) -> F4:
    light = np.full((side_px, side_px, 3), GREY, dtype=np.float32)
    exposed = outlined(frame.rgba, outline.share)
    exposed[..., :3] *= gain
    light[frame.region.slices] = over(exposed, light[frame.region.slices])
    return light
