"""What Blender's subsurface radius means: light through slabs falls as transport theory says."""

import math

import bpy
import pytest

from services.worker.render.blender import film, session
from services.worker.render.blender.material import principled_node
from services.worker.render.settings import Denoise, Prefilter, RenderSettings
from services.worker.scene.scattering import decay_per_mean_free_path, walk_albedo

pytestmark = pytest.mark.render

ALBEDO, RADIUS_MM = 0.42, 0.8
SETTINGS = RenderSettings(256, Denoise.NONE, Prefilter.NONE)


def _light_through(thickness_mm: float) -> float:
    """Return the radiance behind a wide slab of flesh in the sun."""
    scene = session.open_session(2, persistent_data=False).scene
    session.apply_settings(scene, SETTINGS, 1)
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    slab = bpy.context.object
    slab.scale = (0.4, 0.4, thickness_mm / 1000.0)
    material = bpy.data.materials.new("flesh")
    material.node_tree.nodes.clear()
    node = principled_node(material.node_tree)
    node.inputs["Base Color"].default_value = (ALBEDO, ALBEDO, ALBEDO, 1.0)
    node.inputs["Subsurface Radius"].default_value = (RADIUS_MM,) * 3
    slab.data.materials.append(material)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = math.pi, (math.pi, 0.0, 0.0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 0.01, (0.0, 0.0, 1.0)
    for thing in (sun, camera):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 24
    return float(film.shoot(scene, film.MemoryFile())[..., :3].mean())


def test_the_radius_is_the_mean_free_path() -> None:
    near_mm, far_mm = 3.0, 6.0
    fall = math.log(_light_through(near_mm) / _light_through(far_mm)) / (far_mm - near_mm)
    expected = decay_per_mean_free_path(walk_albedo(ALBEDO)) / RADIUS_MM
    assert fall == pytest.approx(expected, rel=0.06)
