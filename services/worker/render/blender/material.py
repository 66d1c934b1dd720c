"""Skin and nails as one Principled shader with random-walk subsurface scattering.

A hand's albedo and heights come mixed (see skin_paint), so the shader is two pictures and a bump.
"""

from dataclasses import dataclass

import bpy

from services.worker.render.blender.mesh import SLACK_ATTRIBUTE, UV_LAYER
from services.worker.render.blender.nodes import Graph
from services.worker.render.blender.skin_images import SkinImages
from services.worker.scene.types import Skin

SKIN_IOR, NAIL_IOR = 1.4, 1.54
NAIL_COAT_ROUGHNESS = 0.26
SURFACE_SHARE = 0.5
"""Of what a smooth surface of this IOR would reflect. Skin's furrows shade each other: fits to
faces and arms (Weyrich et al. 2006) scale the lobe by 0.2 to 0.4, the oil between them gives some
back. In full it lies over the darkest skin like silver."""
METRES_PER_MM = 0.001
WHOLE_PIXEL = 1.0
"""Slopes are taken across a pixel, not a tenth of one, or fine relief turns to noise."""
NORMALS = ("Normal", "Coat Normal")
WALK_LOSS, WALK_GAIN_PER_ALBEDO = 0.18, -0.27
"""The random walk returns less than the base colour: a colour raised by the factor
1 + loss + gain x albedo returns its albedo, as measured without surface reflection."""


@dataclass(frozen=True)
class SkinMaterial:
    """The shader and its nodes that change from hand to hand."""

    material: bpy.types.Material
    principled: bpy.types.Node
    albedo: bpy.types.Node
    relief: bpy.types.Node
    bump: bpy.types.Node
    raising: bpy.types.Node

    def paint(
        self, skin: Skin, images: SkinImages, *, relief: bool, scatters: bool, walked: bool
    ) -> None:
        """Set pictures and scattering; without relief the normal stays the mesh's own.

        Where light does not wander it leaves where it came in, with the albedo's share of it; where
        it does, it is `walked` through the flesh or blurred.

        RANDOM_WALK's radius is the mean free path itself, as tests/render/test_scattering.py
        measures; releases of Blender have differed.
        """
        self.albedo.image, self.relief.image = images.albedo, images.relief
        self._bend_normals(bent=relief)
        polish = skin.nail_polish
        coat_roughness = polish.roughness if polish else NAIL_COAT_ROUGHNESS
        self.principled.inputs["Coat Roughness"].default_value = coat_roughness
        self.principled.inputs["Subsurface Weight"].default_value = float(scatters)
        gain, loss = (WALK_GAIN_PER_ALBEDO, WALK_LOSS) if scatters and walked else (0.0, 0.0)
        self.raising.inputs[1].default_value = (gain,) * 3
        self.raising.inputs[2].default_value = (1.0 + loss,) * 3
        self.principled.inputs["Subsurface Radius"].default_value = skin.mean_free_path_mm

    def _bend_normals(self, *, bent: bool) -> None:
        links = self.material.node_tree.links
        for name in NORMALS:
            socket = self.principled.inputs[name]
            if bent and not socket.is_linked:
                links.new(self.bump.outputs["Normal"], socket)
            elif socket.is_linked and not bent:
                links.remove(socket.links[0])


def new_skin_material() -> SkinMaterial:
    """Build the shader; `paint` must be called before it is used."""
    material = bpy.data.materials.new("skin")
    material.node_tree.nodes.clear()
    graph = Graph(material.node_tree)
    principled = principled_node(material.node_tree)
    uv = graph.uv(UV_LAYER)
    albedo, relief = graph.picture(uv, "Linear"), graph.picture(uv, "Linear")
    raising = graph.vector_math("MULTIPLY_ADD")
    graph.link(albedo.outputs["Color"], raising.inputs[0])
    base = graph.vector_math("MULTIPLY")
    graph.link(albedo.outputs["Color"], base.inputs[0])
    graph.link(raising.outputs[0], base.inputs[1])
    graph.link(base.outputs[0], principled.inputs["Base Color"])
    graph.link(albedo.outputs["Alpha"], principled.inputs["Roughness"])
    still, folds, coat, _ = graph.channels(relief)
    graph.link(coat, principled.inputs["Coat Weight"])
    height = graph.math("MULTIPLY_ADD")
    graph.link(folds, height.inputs[0])
    graph.link(graph.attribute(SLACK_ATTRIBUTE), height.inputs[1])
    graph.link(still, height.inputs[2])
    bump = graph.bump(METRES_PER_MM, WHOLE_PIXEL)
    graph.link(height.outputs[0], bump.inputs["Height"])
    return SkinMaterial(material, principled, albedo, relief, bump, raising)


def principled_node(tree: bpy.types.NodeTree) -> bpy.types.Node:
    """Add the shader of skin to an empty tree, every input set, and the tree's output."""
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.distribution = "GGX"
    node.subsurface_method = "RANDOM_WALK"
    values: dict[str, float | bool | tuple[float, ...]] = {
        "Metallic": 0.0,
        "Thin Wall": False,
        "Diffuse Roughness": 0.0,
        "Anisotropic": 0.0,
        "Anisotropic Rotation": 0.0,
        "Thin Film Thickness": 0.0,
        "Thin Film IOR": 1.33,
        "IOR": SKIN_IOR,
        "Specular IOR Level": SURFACE_SHARE * 0.5,
        "Specular Tint": (1.0, 1.0, 1.0, 1.0),
        "Subsurface Weight": 1.0,
        "Subsurface Scale": METRES_PER_MM,
        "Subsurface Anisotropy": 0.0,
        "Transmission Weight": 0.0,
        "Coat Weight": 0.0,
        "Coat IOR": NAIL_IOR,
        "Coat Tint": (1.0, 1.0, 1.0, 1.0),
        "Coat Roughness": NAIL_COAT_ROUGHNESS,
        "Sheen Weight": 0.0,
        "Sheen Roughness": 0.5,
        "Sheen Tint": (1.0, 1.0, 1.0, 1.0),
        "Emission Strength": 0.0,
        "Alpha": 1.0,
    }
    for name, value in values.items():
        node.inputs[name].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return node
