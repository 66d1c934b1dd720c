"""Skin and nails as one Principled shader with random-walk subsurface scattering."""

import math
from dataclasses import dataclass

import bpy

from services.worker.render.blender.mesh import NAIL_ATTRIBUTE, PALM_ATTRIBUTE
from services.worker.scene.types import Rgb, Skin

SKIN_IOR = 1.4
NAIL_ROUGHNESS = 0.3
METRES_PER_MM = 0.001
RADIUS_PER_MEAN_FREE_PATH = 4.0 * math.pi
"""Cycles' RANDOM_WALK walks with a mean free path of radius / (4 pi)."""


@dataclass(frozen=True)
class SkinMaterial:
    """The shader's inputs that change from hand to hand."""

    material: bpy.types.Material
    principled: bpy.types.Node
    colours: dict[str, bpy.types.NodeSocket]
    skin_roughness: bpy.types.NodeSocket

    def paint(self, skin: Skin) -> None:
        """Set albedos, roughness and scattering.

        skin.mean_free_path_mm is the transport mean free path 1 / (sigma_a + sigma_s') of the
        flesh for red, green and blue light, in millimetres.
        """
        self.colours["dorsum"].default_value = (*skin.dorsum_rgb, 1.0)
        self.colours["palm"].default_value = (*skin.palm_rgb, 1.0)
        self.colours["nail"].default_value = (*skin.nail_rgb, 1.0)
        self.skin_roughness.default_value = skin.roughness
        self.principled.inputs["Subsurface Radius"].default_value = _radius(skin.mean_free_path_mm)


def new_skin_material() -> SkinMaterial:
    """Build the shader: dorsum, palm and nail albedos mixed by the mesh's attributes."""
    material = bpy.data.materials.new("skin")
    tree = material.node_tree
    tree.nodes.clear()
    principled = _principled(tree)
    palm, nail = _attribute(tree, PALM_ATTRIBUTE), _attribute(tree, NAIL_ATTRIBUTE)
    skin_mix = _mix(tree, "RGBA", palm)
    all_mix = _mix(tree, "RGBA", nail)
    tree.links.new(skin_mix.outputs["Result"], all_mix.inputs["A"])
    tree.links.new(all_mix.outputs["Result"], principled.inputs["Base Color"])
    roughness = _mix(tree, "FLOAT", nail)
    roughness.inputs["B"].default_value = NAIL_ROUGHNESS
    tree.links.new(roughness.outputs["Result"], principled.inputs["Roughness"])
    colours = {
        "dorsum": skin_mix.inputs["A"],
        "palm": skin_mix.inputs["B"],
        "nail": all_mix.inputs["B"],
    }
    return SkinMaterial(material, principled, colours, roughness.inputs["A"])


def _radius(mean_free_path_mm: Rgb) -> Rgb:
    red, green, blue = (RADIUS_PER_MEAN_FREE_PATH * length for length in mean_free_path_mm)
    return (red, green, blue)


def _principled(tree: bpy.types.NodeTree) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.distribution = "GGX"
    node.subsurface_method = "RANDOM_WALK"
    values: dict[str, float | bool] = {
        "Metallic": 0.0,
        "Thin Wall": False,
        "Diffuse Roughness": 0.0,
        "Anisotropic": 0.0,
        "Thin Film Thickness": 0.0,
        "IOR": SKIN_IOR,
        "Specular IOR Level": 0.5,
        "Subsurface Weight": 1.0,
        "Subsurface Scale": METRES_PER_MM,
        "Subsurface Anisotropy": 0.0,
        "Transmission Weight": 0.0,
        "Coat Weight": 0.0,
        "Sheen Weight": 0.0,
        "Emission Strength": 0.0,
        "Alpha": 1.0,
    }
    for name, value in values.items():
        node.inputs[name].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return node


def _attribute(tree: bpy.types.NodeTree, name: str) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type = "GEOMETRY"
    node.attribute_name = name
    return node.outputs["Fac"]


def _mix(tree: bpy.types.NodeTree, data_type: str, factor: bpy.types.NodeSocket) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type = data_type
    node.blend_type = "MIX"
    tree.links.new(factor, node.inputs["Factor"])
    return node
