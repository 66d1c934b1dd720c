"""Measures skin as a laboratory would: its bare albedo, and how it looks under even white light."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt

from services.worker.render.blender.cycles import CyclesRenderer
from services.worker.render.detail import Detail
from services.worker.render.rect import PixelRect
from services.worker.render.settings import Denoise, Prefilter, RenderSettings
from services.worker.scene.types import HandScene, Light, SceneGeometry

ALBEDO_SETTINGS = RenderSettings(4, Denoise.NONE, Prefilter.NONE)
WHITE_SETTINGS = RenderSettings(32, Denoise.NONE, Prefilter.NONE)

Pixels = npt.NDArray[np.float32]


class SkinMeter(CyclesRenderer):
    """A Cycles renderer that can also show a hand's albedo, and light it evenly from all sides."""

    def __init__(self, threads: int, cache_dir: Path) -> None:
        super().__init__(threads, cache_dir)
        self._room = self._scene.world
        self._white = _white_world()
        self._even = False
        self.detail: Detail | None = None
        """What to draw of the skin whatever the hand's size; None: what the renderer would."""

    def albedo(self, scene: HandScene, geometry: SceneGeometry) -> Pixels:
        """Return the hand's diffuse albedo, the shader's own picture drawn as if it glowed."""
        tree = self._skin.material.node_tree
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
        glow = tree.nodes.new("ShaderNodeEmission")
        glow.inputs["Strength"].default_value = 1.0
        tree.links.new(self._skin.albedo.outputs["Color"], glow.inputs["Color"])
        tree.links.new(glow.outputs["Emission"], output.inputs["Surface"])
        pixels = self.whole(scene, geometry, ALBEDO_SETTINGS)
        tree.links.new(self._skin.principled.outputs["BSDF"], output.inputs["Surface"])
        tree.nodes.remove(glow)
        return pixels

    def under_white(
        self, scene: HandScene, geometry: SceneGeometry, *, polarised: bool = False
    ) -> Pixels:
        """Return the hand under radiance 1 from everywhere: there a white diffuser has radiance 1.

        polarised: without the light that the surface reflects, as through crossed polarisers.
        """
        level = self._skin.principled.inputs["Specular IOR Level"]
        whole = level.default_value
        with self._evenly_lit():
            level.default_value = 0.0 if polarised else whole
            pixels = self.whole(scene, geometry, WHITE_SETTINGS)
            level.default_value = whole
        return pixels

    def whole(self, scene: HandScene, geometry: SceneGeometry, settings: RenderSettings) -> Pixels:
        """Return the whole picture, (H, W, 4) linear and premultiplied."""
        lens = scene.camera.intrinsics
        region = PixelRect(0, 0, lens.width_px, lens.height_px)
        return self.render(scene, geometry, region, settings).rgba

    def _detail(self, scene: HandScene, geometry: SceneGeometry) -> Detail:
        return self.detail or super()._detail(scene, geometry)

    @contextmanager
    def _evenly_lit(self) -> Iterator[None]:
        self._scene.world, self._even = self._white, True
        try:
            yield
        finally:
            self._scene.world, self._even = self._room, False

    def _light(self, light: Light) -> None:
        if not self._even:
            super()._light(light)


def _white_world() -> bpy.types.World:
    world = bpy.data.worlds.new("white")
    tree = world.node_tree
    tree.nodes.clear()
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    background.inputs["Strength"].default_value = 1.0
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return world
