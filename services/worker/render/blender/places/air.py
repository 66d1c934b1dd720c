"""The clear sky and the sun of Blender's multiple-scattering atmosphere, measured as numbers."""

import math
from pathlib import Path

import bpy
import numpy as np

from services.worker.places.place import Point, Sky
from services.worker.render.blender.places.photograph import F4, photograph, set_noise

SUN_RAD = 0.00951
"""Angle that the sun's disc fills."""
SKY_PX = 512
"""Width of the clear sky: it has no detail."""
_LENS_RAD, _LENS_PX = 0.0125, 32
_LOWEST_SUN_DEG = -0.25
"""Below this nothing of the sun's disc is above the horizon."""


def clear_sky(scene: bpy.types.Scene, sky: Sky, scratch: Path) -> F4:
    """Return the sky's radiance (SKY_PX / 2, SKY_PX, 3) f4 without sun; below the horizon any."""
    _world(scene, sky, disc=False)
    scene.render.film_transparent = False
    set_noise(scene, 1, denoise=False, clamp=0.0)
    shot = photograph(scene, SKY_PX, SKY_PX // 2, scratch)
    scene.render.film_transparent = True
    return shot.light


def sun_irradiance(scene: bpy.types.Scene, sky: Sky, scratch: Path) -> Point:
    """Return what the sun's disc gives a surface that faces it, measured through a long lens."""
    if sky.sun_elevation_deg < _LOWEST_SUN_DEG:
        return (0.0, 0.0, 0.0)
    _world(scene, sky, disc=True)
    pano = scene.camera
    lens = bpy.data.cameras.new("lens")
    lens.type, lens.angle = "PERSP", _LENS_RAD
    aimed = bpy.data.objects.new("lens", lens)
    elevation, azimuth = math.radians(sky.sun_elevation_deg), math.radians(sky.sun_azimuth_deg)
    aimed.rotation_euler = (math.pi / 2.0 + elevation, 0.0, azimuth - math.pi / 2.0)
    scene.collection.objects.link(aimed)
    scene.camera = aimed
    scene.render.film_transparent = False
    set_noise(scene, 4, denoise=False, clamp=0.0)
    disc = photograph(scene, _LENS_PX, _LENS_PX, scratch).light
    scene.render.film_transparent = True
    scene.camera = pano
    bpy.data.objects.remove(aimed)
    total = disc.astype(np.float64).mean(axis=(0, 1)) * _LENS_RAD**2
    return (float(total[0]), float(total[1]), float(total[2]))


def show_picture(scene: bpy.types.Scene, pixels: F4) -> None:
    """Light the scene by an equirectangular picture (H, W, 3) of the whole sphere."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("sky", width, height, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    opaque = np.concatenate([pixels[::-1], np.ones((height, width, 1), np.float32)], axis=-1)
    image.pixels.foreach_set(np.ascontiguousarray(opaque, dtype=np.float32).ravel())
    world, tree, background = _empty_world(scene)
    world.cycles.sampling_method = "MANUAL"
    world.cycles.sample_map_resolution = 256
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])


def show_colour(scene: bpy.types.Scene, rgb: Point) -> None:
    """Light the scene evenly from all around (black: not at all)."""
    _, _, background = _empty_world(scene)
    background.inputs["Color"].default_value = (*rgb, 1.0)


def _world(scene: bpy.types.Scene, sky: Sky, *, disc: bool) -> None:
    _, tree, background = _empty_world(scene)
    node = tree.nodes.new("ShaderNodeTexSky")
    node.sky_type = "MULTIPLE_SCATTERING"
    node.sun_disc, node.sun_size, node.sun_intensity = disc, SUN_RAD, 1.0
    node.sun_elevation = math.radians(sky.sun_elevation_deg)
    # Blender turns the sun clockwise from +y; ours is counter-clockwise from +x.
    node.sun_rotation = math.radians(90.0 - sky.sun_azimuth_deg)
    node.altitude = sky.altitude_m
    node.air_density, node.aerosol_density = 1.0, sky.haze
    node.ozone_density = sky.ozone
    tree.links.new(node.outputs["Color"], background.inputs["Color"])


def _empty_world(
    scene: bpy.types.Scene,
) -> tuple[bpy.types.World, bpy.types.NodeTree, bpy.types.Node]:
    world = bpy.data.worlds.new("air")
    scene.world = world
    tree = world.node_tree
    tree.nodes.clear()
    background = tree.nodes.new("ShaderNodeBackground")
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs["Background"], output.inputs["Surface"])
    return world, tree, background
