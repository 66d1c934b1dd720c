"""Shaders of ornaments: metal, stone, leather and paint as one; woven and knitted cloth."""

import math
from dataclasses import dataclass

import bpy

from services.worker.ornaments.mesh import OrnamentMaterial, Pattern
from services.worker.render.blender.mesh import UV_LAYER

COAT_ROUGHNESS = 0.03
SHEEN_ROUGHNESS = 0.5
CLOTH_IOR = 1.45
STRIPE_EDGE = 8.0
"""How sharp stripes are: the slope of a sine that is cut off at 0 and 1."""
RELIEF = 0.35
"""Height of threads and stitches, by their width."""

type Socket = bpy.types.NodeSocket


@dataclass(frozen=True)
class HardMaterial:
    """Metal, stone, leather, rubber, lacquer: one Principled shader."""

    material: bpy.types.Material
    principled: bpy.types.Node

    def paint(self, stuff: OrnamentMaterial) -> None:
        """Set what the ornament is made of."""
        inputs = self.principled.inputs
        inputs["Base Color"].default_value = (*stuff.base_rgb, 1.0)
        inputs["Metallic"].default_value = stuff.metallic
        inputs["Roughness"].default_value = stuff.roughness
        inputs["Coat Weight"].default_value = stuff.coat
        inputs["IOR"].default_value = stuff.ior


@dataclass(frozen=True)
class ClothMaterial:
    """Two colours over the UVs, and the relief of threads or of stitches, which are V's.

    The second colour's share is (across of u's stripes) + (along of v's stripes).
    """

    material: bpy.types.Material
    principled: bpy.types.Node
    colours: bpy.types.Node
    across: Socket
    along: Socket
    repeat_m: tuple[Socket, ...]
    stitch_m: tuple[Socket, ...]
    slant: Socket
    bump: bpy.types.Node

    def paint(self, stuff: OrnamentMaterial) -> None:
        """Set colours, pattern and relief; ValueError if it is no cloth."""
        cloth = stuff.cloth
        if cloth is None:
            raise ValueError(f"{stuff} is no cloth")
        self.colours.inputs["A"].default_value = (*stuff.base_rgb, 1.0)
        self.colours.inputs["B"].default_value = (*cloth.second_rgb, 1.0)
        striped = 1.0 if cloth.pattern is Pattern.STRIPES else 0.0
        checked = 0.5 if cloth.pattern is Pattern.CHECK else 0.0
        # A jumper's stripes are rings, a shirt's run along the arm.
        self.across.default_value = (0.0 if cloth.knitted else striped) + checked
        self.along.default_value = (striped if cloth.knitted else 0.0) + checked
        for socket in self.repeat_m:
            socket.default_value = cloth.repeat_m
        for socket in self.stitch_m:
            socket.default_value = cloth.stitch_m
        self.slant.default_value = 1.0 if cloth.knitted else 0.0
        self.bump.inputs["Distance"].default_value = RELIEF * cloth.stitch_m
        self.principled.inputs["Roughness"].default_value = stuff.roughness
        self.principled.inputs["Sheen Weight"].default_value = cloth.sheen


def new_hard_material(name: str) -> HardMaterial:
    """Build the shader of what is hard or smooth."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    return HardMaterial(material, _principled(tree, {"Coat Roughness": COAT_ROUGHNESS}))


def new_cloth_material(name: str) -> ClothMaterial:
    """Build the shader of cloth."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    principled = _principled(
        tree, {"Sheen Roughness": SHEEN_ROUGHNESS, "Diffuse Roughness": 0.5, "IOR": CLOTH_IOR}
    )
    u, v = _uv(tree)
    stripe_u, repeat_u = _stripes(tree, u)
    stripe_v, repeat_v = _stripes(tree, v)
    across, along = _math(tree, "MULTIPLY", stripe_u), _math(tree, "MULTIPLY", stripe_v)
    share = _math(tree, "ADD", across.outputs[0], along.outputs[0])
    colours = tree.nodes.new("ShaderNodeMix")
    colours.data_type, colours.blend_type = "RGBA", "MIX"
    tree.links.new(share.outputs[0], colours.inputs["Factor"])
    tree.links.new(colours.outputs["Result"], principled.inputs["Base Color"])
    height, stitch_m, slant = _relief(tree, u, v)
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Strength"].default_value = 1.0
    tree.links.new(height, bump.inputs["Height"])
    tree.links.new(bump.outputs["Normal"], principled.inputs["Normal"])
    return ClothMaterial(
        material,
        principled,
        colours,
        across.inputs[1],
        along.inputs[1],
        (repeat_u, repeat_v),
        stitch_m,
        slant,
        bump,
    )


def _stripes(tree: bpy.types.NodeTree, place: Socket) -> tuple[Socket, Socket]:
    """Return 0 or 1 in turn along a coordinate, and the socket of their repeat."""
    cycles = _math(tree, "DIVIDE", place)
    wave = _math(tree, "SINE", _scaled(tree, cycles.outputs[0], 2.0 * math.pi))
    edge = _math(tree, "MULTIPLY_ADD", wave.outputs[0], STRIPE_EDGE, 0.5)
    edge.use_clamp = True
    return edge.outputs[0], cycles.inputs[1]


def _relief(
    tree: bpy.types.NodeTree, u: Socket, v: Socket
) -> tuple[Socket, tuple[Socket, ...], Socket]:
    """Return (0.6 + 0.4 sin(2 pi (v / w + slant c))) sin(2 pi c), the sockets of w, and the slant.

    c = |fract(u / w) - 1/2| is a column's distance from its middle: with a slant rows are V's.
    """
    column, row = _math(tree, "DIVIDE", u), _math(tree, "DIVIDE", v)
    fraction = _math(tree, "FRACT", column.outputs[0])
    centred = _math(tree, "SUBTRACT", fraction.outputs[0], 0.5)
    distance = _math(tree, "ABSOLUTE", centred.outputs[0]).outputs[0]
    slant = _math(tree, "MULTIPLY", distance)
    phase = _math(tree, "ADD", row.outputs[0], slant.outputs[0])
    rows = _math(tree, "SINE", _scaled(tree, phase.outputs[0], 2.0 * math.pi))
    lifted = _math(tree, "MULTIPLY_ADD", rows.outputs[0], 0.4, 0.6)
    columns = _math(tree, "SINE", _scaled(tree, distance, 2.0 * math.pi))
    height = _math(tree, "MULTIPLY", lifted.outputs[0], columns.outputs[0])
    return height.outputs[0], (column.inputs[1], row.inputs[1]), slant.inputs[1]


def _uv(tree: bpy.types.NodeTree) -> tuple[Socket, Socket]:
    node = tree.nodes.new("ShaderNodeUVMap")
    node.uv_map = UV_LAYER
    parts = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(node.outputs["UV"], parts.inputs["Vector"])
    return parts.outputs["X"], parts.outputs["Y"]


def _scaled(tree: bpy.types.NodeTree, value: Socket, factor: float) -> Socket:
    return _math(tree, "MULTIPLY", value, factor).outputs[0]


def _math(tree: bpy.types.NodeTree, operation: str, *values: Socket | float) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    for place, value in enumerate(values):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, node.inputs[place])
        else:
            node.inputs[place].default_value = value
    return node


def _principled(tree: bpy.types.NodeTree, changes: dict[str, float]) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.distribution = "MULTI_GGX"
    values: dict[str, float | bool] = {
        "Metallic": 0.0,
        "Thin Wall": False,
        "Diffuse Roughness": 0.0,
        "Anisotropic": 0.0,
        "Thin Film Thickness": 0.0,
        "IOR": 1.5,
        "Specular IOR Level": 0.5,
        "Subsurface Weight": 0.0,
        "Transmission Weight": 0.0,
        "Coat Weight": 0.0,
        "Coat IOR": 1.5,
        "Sheen Weight": 0.0,
        "Emission Strength": 0.0,
        "Alpha": 1.0,
    }
    for name, value in (values | changes).items():
        node.inputs[name].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return node
