"""Skin and nails as one Principled shader with random-walk subsurface scattering.

Albedo is base x exp(sum of gain x map), so the maps are uploaded once and a hand's colour is a
handful of numbers.
"""

import math
from dataclasses import dataclass

import bpy
import numpy as np

from services.worker.render.blender.mesh import SLACK_ATTRIBUTE, UV_LAYER
from services.worker.render.blender.nodes import Graph
from services.worker.render.blender.skin_images import SkinImages
from services.worker.scene.skin import base_rgb
from services.worker.scene.types import Pigment, ReliefStrength, Rgb, Skin

SKIN_IOR, NAIL_IOR = 1.4, 1.54
NAIL_ROUGHNESS, NAIL_COAT, NAIL_COAT_ROUGHNESS = 0.34, 0.15, 0.26
PALM_SMOOTHER = 0.05
"""A palm's skin is a little moist: its roughness is lower by this."""
FREE_EDGE_RGB: Rgb = (0.62, 0.55, 0.46)
LUNULA_PALER = 0.35
METRES_PER_MM = 0.001
WHOLE_PIXEL = 1.0
"""Slopes are taken across a pixel, not a tenth of one, or fine relief turns to noise."""


@dataclass(frozen=True)
class SkinMaterial:
    """The shader's inputs that change from hand to hand."""

    material: bpy.types.Material
    principled: bpy.types.Node
    images: tuple[bpy.types.Node, bpy.types.Node, bpy.types.Node]
    gains: tuple[bpy.types.NodeSocket, ...]
    log_base: bpy.types.NodeSocket
    nail: dict[str, bpy.types.NodeSocket]
    heights: tuple[bpy.types.NodeSocket, ...]
    roughness: dict[str, bpy.types.NodeSocket]

    def paint(self, skin: Skin, images: SkinImages) -> None:
        """Set maps, pigment, relief, roughness and scattering.

        RANDOM_WALK's radius is the mean free path itself, as tests/render/test_scattering.py
        measures; releases of Blender have differed.
        """
        for node, image in zip(
            self.images, (images.pigment, images.marks, images.relief), strict=True
        ):
            if node.image != image:
                node.image = image
        gains = skin.pigment.gains()
        for socket, gain in zip(self.gains, gains, strict=True):
            socket.default_value = gain
        offset = np.array(Pigment.NEUTRAL) @ np.array(gains)
        self.log_base.default_value = tuple(np.log(base_rgb(skin, images.dorsum)) - offset)
        self._paint_nails(skin)
        for socket, strength in zip(self.heights, _strengths(skin.relief), strict=True):
            socket.default_value = strength
        self.roughness["hairy"].default_value = skin.roughness
        self.roughness["glabrous"].default_value = skin.roughness - PALM_SMOOTHER
        self.principled.inputs["Subsurface Radius"].default_value = skin.mean_free_path_mm

    def _paint_nails(self, skin: Skin) -> None:
        polish = skin.nail_polish
        paint = polish.rgb if polish is not None else None
        bed = paint or skin.nail_rgb
        lunula = paint or _mixed(bed, FREE_EDGE_RGB, LUNULA_PALER)
        self.nail["bed"].default_value = (*bed, 1.0)
        self.nail["lunula"].default_value = (*lunula, 1.0)
        self.nail["edge"].default_value = (*(paint or FREE_EDGE_RGB), 1.0)
        self.roughness["nail"].default_value = (
            polish.roughness if paint and polish else (NAIL_ROUGHNESS)
        )
        self.nail["coat"].default_value = 1.0 if polish else NAIL_COAT
        coat_roughness = polish.roughness if polish else NAIL_COAT_ROUGHNESS
        self.principled.inputs["Coat Roughness"].default_value = coat_roughness


def new_skin_material() -> SkinMaterial:
    """Build the shader; `paint` must be called before it is used."""
    material = bpy.data.materials.new("skin")
    material.node_tree.nodes.clear()
    graph = Graph(material.node_tree)
    principled = principled_node(material.node_tree)
    uv = graph.uv(UV_LAYER)
    pictures = tuple(graph.picture(uv, "Linear") for _ in range(3))
    glabrous, blood, melanin, veins = graph.channels(pictures[0])
    freckles, age_spots, plate, zone = graph.channels(pictures[1])
    log_base, gains, skin_rgb = _pigmented(
        graph, (glabrous, blood, melanin, veins, freckles, age_spots)
    )
    nail, nail_rgb = _nail(graph, zone)
    albedo = graph.mixed("RGBA", plate, skin_rgb, nail_rgb)
    graph.link(albedo, principled.inputs["Base Color"])
    roughness = _roughness(graph, glabrous, plate, principled)
    nail["coat"] = graph.scaled(plate, principled.inputs["Coat Weight"])
    heights = _relief(graph, pictures[2], principled)
    return SkinMaterial(
        material,
        principled,
        (pictures[0], pictures[1], pictures[2]),
        gains,
        log_base,
        nail,
        heights,
        roughness,
    )


def _pigmented(
    graph: Graph, maps: tuple[bpy.types.NodeSocket, ...]
) -> tuple[bpy.types.NodeSocket, tuple[bpy.types.NodeSocket, ...], bpy.types.NodeSocket]:
    """exp(log base + sum of gain x map): its inputs and its output."""
    gains = []
    start: bpy.types.NodeSocket | None = None
    total: bpy.types.NodeSocket | None = None
    for value in maps:
        node = graph.vector_math("MULTIPLY_ADD")
        graph.link(value, node.inputs[0])
        gains.append(node.inputs[1])
        if total is None:
            start = node.inputs[2]
        else:
            graph.link(total, node.inputs[2])
        total = node.outputs[0]
    power = graph.vector_math("POWER")
    power.inputs[0].default_value = (math.e,) * 3
    graph.link(total, power.inputs[1])
    return start, tuple(gains), power.outputs[0]


def _nail(
    graph: Graph, zone: bpy.types.NodeSocket
) -> tuple[dict[str, bpy.types.NodeSocket], bpy.types.NodeSocket]:
    """Lunula, bed and free edge by zone 0, 0.5 and 1."""
    paler = graph.mix_node("RGBA", graph.ramp(zone, 0.5, 0.0))
    edged = graph.mix_node("RGBA", graph.ramp(zone, 0.5, 1.0))
    graph.link(graph.result(paler), graph.side(edged, "A"))
    sockets = {
        "bed": graph.side(paler, "A"),
        "lunula": graph.side(paler, "B"),
        "edge": graph.side(edged, "B"),
    }
    return sockets, graph.result(edged)


def _roughness(
    graph: Graph,
    glabrous: bpy.types.NodeSocket,
    plate: bpy.types.NodeSocket,
    principled: bpy.types.Node,
) -> dict[str, bpy.types.NodeSocket]:
    skin, nails = graph.mix_node("FLOAT", glabrous), graph.mix_node("FLOAT", plate)
    graph.link(graph.result(skin), graph.side(nails, "A"))
    graph.link(graph.result(nails), principled.inputs["Roughness"])
    return {
        "hairy": graph.side(skin, "A"),
        "glabrous": graph.side(skin, "B"),
        "nail": graph.side(nails, "B"),
    }


def _relief(
    graph: Graph, picture: bpy.types.Node, principled: bpy.types.Node
) -> tuple[bpy.types.NodeSocket, ...]:
    """Bend the normal by the sum of the heights; return their strengths, as ReliefStrength."""
    folds, slack, pattern, sinews = graph.channels(picture)
    stretched = graph.product(slack, graph.attribute(SLACK_ATTRIBUTE))
    total: bpy.types.NodeSocket | None = None
    strengths = []
    for height in (folds, stretched, pattern, sinews):
        node = graph.math("MULTIPLY_ADD")
        graph.link(height, node.inputs[0])
        strengths.append(node.inputs[1])
        if total is None:
            node.inputs[2].default_value = 0.0
        else:
            graph.link(total, node.inputs[2])
        total = node.outputs[0]
    bump = graph.bump(METRES_PER_MM, WHOLE_PIXEL)
    graph.link(total, bump.inputs["Height"])
    for name in ("Normal", "Coat Normal"):
        graph.link(bump.outputs["Normal"], principled.inputs[name])
    return tuple(strengths)


def _strengths(relief: ReliefStrength) -> tuple[float, float, float, float]:
    return (relief.folds, relief.slack, relief.pattern, relief.sinews)


def _mixed(first: Rgb, second: Rgb, share: float) -> Rgb:
    red, green, blue = (a + share * (b - a) for a, b in zip(first, second, strict=True))
    return (red, green, blue)


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
        "Specular IOR Level": 0.5,
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
