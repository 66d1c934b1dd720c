"""Ornaments in the Blender scene: there while an image wears them, gone with the next."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from services.worker.ornaments.mesh import OrnamentMesh
from services.worker.render.blender.mesh import UV_LAYER, remove
from services.worker.render.blender.ornament_material import (
    ClothMaterial,
    HardMaterial,
    new_cloth_material,
    new_hard_material,
)


@dataclass
class OrnamentRack:
    """The ornaments on show, and materials kept for the next ones: one for each mesh of a kind."""

    scene: bpy.types.Scene
    shown: list[bpy.types.Object] = field(default_factory=list)
    hard: list[HardMaterial] = field(default_factory=list)
    cloth: list[ClothMaterial] = field(default_factory=list)

    def show(self, ornaments: tuple[OrnamentMesh, ...]) -> None:
        """Show exactly these ornaments, in world metres."""
        while self.shown:
            remove(self.shown.pop())
        hard = cloth = 0
        for ornament in ornaments:
            is_cloth = ornament.material.cloth is not None
            material = self._cloth(cloth) if is_cloth else self._hard(hard)
            hard, cloth = hard + (not is_cloth), cloth + is_cloth
            material.paint(ornament.material)
            self.shown.append(_new_object(self.scene, ornament, material.material))

    def _hard(self, number: int) -> HardMaterial:
        if number == len(self.hard):
            self.hard.append(new_hard_material(f"ornament.{number}"))
        return self.hard[number]

    def _cloth(self, number: int) -> ClothMaterial:
        if number == len(self.cloth):
            self.cloth.append(new_cloth_material(f"cloth.{number}"))
        return self.cloth[number]


def _new_object(
    scene: bpy.types.Scene, ornament: OrnamentMesh, material: bpy.types.Material
) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(ornament.name.value)
    quads = np.ascontiguousarray(ornament.quads, dtype=np.int32)
    mesh.vertices.add(len(ornament.vertices_m))
    mesh.loops.add(quads.size)
    mesh.polygons.add(len(quads))
    mesh.vertices.foreach_set("co", ornament.vertices_m.astype(np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", quads.ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.uv_layers.new(name=UV_LAYER)
    mesh.uv_layers[UV_LAYER].data.foreach_set("uv", ornament.uvs_m.ravel())
    mesh.update(calc_edges=True)
    if ornament.smooth:
        mesh.shade_smooth()
    else:
        mesh.shade_flat()
    mesh.materials.append(material)
    shown = bpy.data.objects.new(ornament.name.value, mesh)
    scene.collection.objects.link(shown)
    return shown
