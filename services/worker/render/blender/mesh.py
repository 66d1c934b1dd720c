"""The hand's mesh: built once for a topology, then only moved."""

import bpy
import numpy as np
import numpy.typing as npt

from services.worker.hand.skinmaps.atlas import atlas_uvs
from services.worker.scene.types import SceneGeometry

SLACK_ATTRIBUTE, UV_LAYER = "slack", "uv"


def new_hand(scene: bpy.types.Scene, geometry: SceneGeometry) -> bpy.types.Object:
    """Add a smooth-shaded mesh object with the geometry's quads and its place in the atlas."""
    mesh = bpy.data.meshes.new("hand")
    quads = np.ascontiguousarray(geometry.quads, dtype=np.int32)
    mesh.vertices.add(len(geometry.vertices_m))
    mesh.loops.add(quads.size)
    mesh.polygons.add(len(quads))
    mesh.loops.foreach_set("vertex_index", quads.ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.uv_layers.new(name=UV_LAYER)
    mesh.uv_layers[UV_LAYER].data.foreach_set("uv", _floats(atlas_uvs(geometry.uvs)))
    mesh.attributes.new(SLACK_ATTRIBUTE, "FLOAT", "POINT")
    reshape(mesh, geometry)
    mesh.shade_smooth()
    hand = bpy.data.objects.new("hand", mesh)
    scene.collection.objects.link(hand)
    return hand


def reshape(mesh: bpy.types.Mesh, geometry: SceneGeometry) -> None:
    """Give a mesh of the same topology the geometry's shape and slackness."""
    mesh.vertices.foreach_set("co", _floats(geometry.vertices_m))
    mesh.attributes[SLACK_ATTRIBUTE].data.foreach_set("value", _floats(geometry.slack))
    mesh.update(calc_edges=True)


def remove(hand: bpy.types.Object) -> None:
    """Delete the object and its mesh, leaving no orphan."""
    mesh = hand.data
    bpy.data.objects.remove(hand)
    bpy.data.meshes.remove(mesh)


def _floats(values: npt.ArrayLike) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32).ravel()
