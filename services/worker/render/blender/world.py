"""The light: an environment panorama turned about the vertical."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from services.worker.scene.environments import panorama_path
from services.worker.scene.types import Light

IMPORTANCE_MAP_PX = 512
"""Width of the map that light is sampled by: within 0.02 dB of a map of 1024 (8 samples, three
environments), and 0.08 s of CPU less to build for every image."""


KEPT_IMAGES = 4
"""Panoramas kept loaded, 19 MB each at 1536 texels: hundreds must not fill memory."""


@dataclass(frozen=True)
class LightingWorld:
    """The scene's world and the panoramas it has loaded so far."""

    mapping: bpy.types.Node
    texture: bpy.types.Node
    images: dict[str, bpy.types.Image] = field(default_factory=dict)

    def light(self, light: Light) -> None:
        """Light the scene. Exposure is not applied here: frames stay in the panorama's units."""
        image = self.images.pop(light.environment, None)
        if image is None:
            image = _load(panorama_path(light.environment))
        self.images[light.environment] = image  # the last one used stands last
        if self.texture.image != image:
            self.texture.image = image
        while len(self.images) > KEPT_IMAGES:
            bpy.data.images.remove(self.images.pop(next(iter(self.images))))
        # Blender turns the looked-up direction, so the panorama turns the other way.
        self.mapping.inputs["Rotation"].default_value[2] = -math.radians(light.rotation_z_deg)


def new_world(scene: bpy.types.Scene, importance_map_px: int = IMPORTANCE_MAP_PX) -> LightingWorld:
    """Give the scene a world that is one equirectangular picture."""
    world = bpy.data.worlds.new("environment")
    scene.world = world
    world.cycles.sampling_method = "MANUAL"
    world.cycles.sample_map_resolution = importance_map_px
    tree = world.node_tree
    tree.nodes.clear()
    coordinate = tree.nodes.new("ShaderNodeTexCoord")
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.vector_type = "POINT"
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.projection = "EQUIRECTANGULAR"
    texture.interpolation = "Linear"
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Strength"].default_value = 1.0
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(coordinate.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return LightingWorld(mapping, texture)


def _load(path: Path) -> bpy.types.Image:
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.name = "Linear Rec.709"
    return image
