"""A place built in this process's Blender: meshes, copies, lamps, and the panoramic camera."""

import math

import bpy
import numpy as np
from mathutils import Matrix, Vector

from services.worker.places.place import (
    AreaLamp,
    Finish,
    Pattern,
    Place,
    Point,
    PointLamp,
    Surface,
    rgb_of,
)
from services.worker.places.shapes import merged
from services.worker.render.blender.places.shaders import new_material

_PEAK = 1e-6
"""Lamps darker than this are left out."""


def build(scene: bpy.types.Scene, place: Place) -> None:
    """Fill an empty scene with a place. The sky and its sun are added elsewhere."""
    materials: dict[Finish, bpy.types.Material] = {}
    for surface in merged(place.surfaces):
        thing = bpy.data.objects.new("surface", _mesh(surface, materials))
        scene.collection.objects.link(thing)
        if surface.finish.pattern is Pattern.GLOW:
            _only_to_look_at(thing)
    for copies in place.copies:
        meshes = [_mesh(surface, materials) for surface in merged(copies.surfaces)]
        _scatter(scene, meshes, copies.at_m, copies.turns_rad, copies.sizes)
    for lamp in place.area_lamps:
        _area_lamp(scene, lamp)
    for bulb in place.point_lamps:
        _point_lamp(scene, bulb)


def add_camera(scene: bpy.types.Scene, eye_m: Point) -> None:
    """Look all around from a point; the middle of the panorama is +x, its left +y."""
    data = bpy.data.cameras.new("eye")
    data.type = "PANO"
    data.panorama_type = "EQUIRECTANGULAR"
    data.clip_start, data.clip_end = 0.01, 1e6
    camera = bpy.data.objects.new("eye", data)
    camera.location = eye_m
    camera.rotation_euler = (math.pi / 2.0, 0.0, -math.pi / 2.0)
    scene.collection.objects.link(camera)
    scene.camera = camera


def add_sun(scene: bpy.types.Scene, towards: Point, irradiance: Point, angle_rad: float) -> None:
    """Shine from a direction with an irradiance (linear RGB) on what faces it."""
    peak = max(irradiance)
    if peak < _PEAK:
        return
    data = bpy.data.lights.new("sun", "SUN")
    data.energy = peak
    data.color = [value / peak for value in irradiance]
    data.angle = angle_rad
    _place_lamp(scene, data, (0.0, 0.0, 0.0), rgb_of(-value for value in towards))


def _mesh(surface: Surface, materials: dict[Finish, bpy.types.Material]) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("surface")
    count = len(surface.quads)
    # Quads whose last two corners are one vertex are triangles.
    folded = surface.quads[:, 2] == surface.quads[:, 3]
    sizes = np.where(folded, 3, 4)
    keep = np.ones((count, 4), dtype=np.bool_)
    keep[:, 3] = ~folded
    mesh.vertices.add(len(surface.vertices_m))
    mesh.vertices.foreach_set("co", surface.vertices_m.astype(np.float32).ravel())
    mesh.loops.add(int(sizes.sum()))
    mesh.loops.foreach_set("vertex_index", surface.quads[keep])
    mesh.polygons.add(count)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32)
    mesh.polygons.foreach_set("loop_start", starts)
    layer = mesh.uv_layers.new(name="metres")
    layer.uv.foreach_set("vector", surface.uvs_m[keep].astype(np.float32).ravel())
    mesh.update(calc_edges=True)
    if surface.smooth:
        mesh.shade_smooth()
    if surface.finish not in materials:
        materials[surface.finish] = new_material(surface.finish)
    mesh.materials.append(materials[surface.finish])
    return mesh


def _only_to_look_at(thing: bpy.types.Object) -> None:
    """Show what glows to the eye and to mirrors; its lamp gives the light, with less noise."""
    thing.visible_diffuse = False
    thing.visible_shadow = False


def _scatter(
    scene: bpy.types.Scene,
    meshes: list[bpy.types.Mesh],
    at_m: np.ndarray,
    turns_rad: np.ndarray,
    sizes: np.ndarray,
) -> None:
    for place, turn, size in zip(at_m, turns_rad, sizes, strict=True):
        for mesh in meshes:
            copy = bpy.data.objects.new("copy", mesh)
            copy.location = tuple(place)
            copy.rotation_euler = (0.0, 0.0, float(turn))
            copy.scale = (float(size),) * 3
            scene.collection.objects.link(copy)


def _area_lamp(scene: bpy.types.Scene, lamp: AreaLamp) -> None:
    peak = max(lamp.radiance)
    if peak < _PEAK:
        return
    data = bpy.data.lights.new("area", "AREA")
    data.shape = "RECTANGLE"
    data.size, data.size_y = lamp.width_m, lamp.height_m
    data.spread = math.radians(lamp.spread_deg)
    # Blender's power of an area lamp: radiance x area x pi (its own documentation of units).
    data.energy = peak * lamp.width_m * lamp.height_m * math.pi
    data.color = [value / peak for value in lamp.radiance]
    _place_lamp(scene, data, lamp.at_m, lamp.towards)


def _point_lamp(scene: bpy.types.Scene, lamp: PointLamp) -> None:
    peak = max(lamp.intensity)
    if peak < _PEAK:
        return
    data = bpy.data.lights.new("point", "POINT")
    data.energy = peak * 4.0 * math.pi * math.pi
    data.color = [value / peak for value in lamp.intensity]
    data.shadow_soft_size = lamp.radius_m
    _place_lamp(scene, data, lamp.at_m, (0.0, 0.0, -1.0))


def _place_lamp(scene: bpy.types.Scene, data: bpy.types.Light, at_m: Point, towards: Point) -> None:
    lamp = bpy.data.objects.new("lamp", data)
    turn = Vector(towards).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    lamp.matrix_world = Matrix.Translation(at_m) @ turn
    lamp.visible_camera = False
    scene.collection.objects.link(lamp)
