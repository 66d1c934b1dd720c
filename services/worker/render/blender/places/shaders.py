"""A finish as a Blender material: a few nodes each, textures by metres."""

from collections.abc import Callable

import bpy

from services.worker.places.place import Finish, Pattern, Rgb

type _Tree = bpy.types.NodeTree
type _Socket = bpy.types.NodeSocket


_GRIT_M = 0.07
_GRIT_SHADES = (0.62, 1.38)
"""What the ground at one's feet is made of: far away it is finer than a texel and averages out."""


def new_material(finish: Finish) -> bpy.types.Material:
    """Return a new material that looks like `finish`."""
    material = bpy.data.materials.new(finish.pattern.value)
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    material.cycles.emission_sampling = "NONE"  # a lamp beside it gives its light
    shader = _glow(tree, finish) if finish.pattern is Pattern.GLOW else _matter(tree, finish)
    tree.links.new(shader, output.inputs["Surface"])
    return material


def _glow(tree: _Tree, finish: Finish) -> _Socket:
    node = tree.nodes.new("ShaderNodeEmission")
    node.inputs["Color"].default_value = (*finish.rgb, 1.0)
    return node.outputs["Emission"]


def _matter(tree: _Tree, finish: Finish) -> _Socket:
    if finish.pattern is Pattern.LEAVES:
        return _leaf(tree, finish)
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.inputs["Roughness"].default_value = finish.roughness
    node.inputs["Metallic"].default_value = finish.metallic
    node.inputs["IOR"].default_value = 1.45
    node.inputs["Specular IOR Level"].default_value = 0.5 if finish.roughness < 0.95 else 0.0
    painter = _PAINTERS[finish.pattern]
    painter(tree, finish, node)
    return node.outputs["BSDF"]


def _leaf(tree: _Tree, finish: Finish) -> _Socket:
    colour = _mixed(tree, _white_noise(tree, _uv(tree)), finish)
    front = tree.nodes.new("ShaderNodeBsdfDiffuse")
    through = tree.nodes.new("ShaderNodeBsdfTranslucent")
    both = tree.nodes.new("ShaderNodeMixShader")
    both.inputs["Factor"].default_value = 0.35
    for shader in (front, through):
        tree.links.new(colour, shader.inputs["Color"])
    tree.links.new(front.outputs["BSDF"], both.inputs[1])
    tree.links.new(through.outputs["BSDF"], both.inputs[2])
    return both.outputs[0]


def _plain(_tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    node.inputs["Base Color"].default_value = (*finish.rgb, 1.0)


def _mottled(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    noise = _noise(tree, _position(tree), 1.0 / finish.scale_m, detail=6.0, roughness=0.65)
    _paint(tree, _mixed(tree, _stretched(tree, noise, 0.3, 0.7), finish), node)


def _patches(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    wide = _noise(tree, _position(tree), 1.0 / finish.scale_m, detail=8.0, roughness=0.72)
    broad = _noise(tree, _position(tree), 0.11 / finish.scale_m, detail=3.0, roughness=0.6)
    colour = _mixed(tree, _stretched(tree, wide, 0.39, 0.61), finish)
    grit = _noise(tree, _position(tree), 1.0 / _GRIT_M, detail=3.0, roughness=0.75)
    gritty = _shaded(tree, colour, grit, *_GRIT_SHADES)
    _paint(tree, _shaded(tree, gritty, broad, 0.72, 1.3), node)
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Strength"].default_value = 0.6
    bump.inputs["Distance"].default_value = finish.scale_m * 0.05
    tree.links.new(wide, bump.inputs["Height"])
    tree.links.new(bump.outputs["Normal"], node.inputs["Normal"])


def _planks(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    brick = _bricks(tree, finish, width=finish.scale_m * 8.0, height=finish.scale_m, gap=0.004)
    brick.inputs["Mortar"].default_value = (*(0.25 * v for v in finish.rgb), 1.0)
    grain = _noise(tree, _scaled_uv(tree, (1.5, 22.0, 1.0)), 1.0, detail=5.0, roughness=0.7)
    _paint(tree, _shaded(tree, brick.outputs["Color"], grain, 0.65, 1.3), node)


def _tiles(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    brick = _bricks(tree, finish, width=finish.scale_m, height=finish.scale_m, gap=0.006)
    brick.offset = 0.0
    rgb = finish.rgb
    brick.inputs["Color2"].default_value = (*(0.88 * v for v in rgb), 1.0)
    brick.inputs["Mortar"].default_value = (*finish.second_rgb, 1.0)
    dirt = _noise(tree, _position(tree), 2.5 / finish.scale_m, detail=4.0, roughness=0.6)
    _paint(tree, _shaded(tree, brick.outputs["Color"], dirt, 0.85, 1.12), node)


def _windows(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    """Walls with rows of glass, as of a block of flats: `second_rgb` is the wall."""
    brick = _bricks(tree, finish, width=finish.scale_m * 0.8, height=finish.scale_m, gap=0.55)
    brick.offset = 0.0
    brick.inputs["Mortar Size"].default_value = 0.2 * finish.scale_m
    brick.inputs["Mortar Smooth"].default_value = 0.0
    brick.inputs["Color1"].default_value = (*finish.rgb, 1.0)
    brick.inputs["Color2"].default_value = (*(0.4 * v for v in finish.rgb), 1.0)
    brick.inputs["Mortar"].default_value = (*finish.second_rgb, 1.0)
    dirt = _noise(tree, _position(tree), 0.35, detail=6.0, roughness=0.6)
    _paint(tree, _shaded(tree, brick.outputs["Color"], dirt, 0.75, 1.2), node)
    rough = tree.nodes.new("ShaderNodeMapRange")
    rough.inputs["To Min"].default_value = 0.12
    rough.inputs["To Max"].default_value = 0.9
    tree.links.new(brick.outputs["Factor"], rough.inputs["Value"])
    tree.links.new(rough.outputs["Result"], node.inputs["Roughness"])


def _veins(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    wave = tree.nodes.new("ShaderNodeTexWave")
    wave.inputs["Scale"].default_value = 0.35 / finish.scale_m
    wave.inputs["Distortion"].default_value = 14.0
    wave.inputs["Detail"].default_value = 4.0
    wave.inputs["Detail Scale"].default_value = 1.6
    tree.links.new(_position(tree), wave.inputs["Vector"])
    _paint(tree, _mixed(tree, _stretched(tree, wave.outputs["Factor"], 0.0, 0.35), finish), node)


def _waves(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    """Water: dark, smooth, with waves that fade to a mean roughness far away."""
    node.inputs["Base Color"].default_value = (*finish.rgb, 1.0)
    node.inputs["IOR"].default_value = 1.33
    noise = _noise(tree, _position(tree), 1.0 / finish.scale_m, detail=4.0, roughness=0.55)
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Strength"].default_value = 0.5
    bump.inputs["Distance"].default_value = 0.12 * finish.scale_m
    tree.links.new(noise, bump.inputs["Height"])
    tree.links.new(bump.outputs["Normal"], node.inputs["Normal"])


def _picture(tree: _Tree, finish: Finish, node: bpy.types.Node) -> None:
    """An abstract painting: soft fields of a few colours."""
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 1.0 / finish.scale_m
    noise.inputs["Detail"].default_value = 1.5
    noise.inputs["Distortion"].default_value = 1.2
    tree.links.new(_position(tree), noise.inputs["Vector"])
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.interpolation = "EASE"
    stops = ramp.color_ramp.elements
    stops[0].position, stops[1].position = 0.35, 0.62
    stops[0].color, stops[1].color = (*finish.rgb, 1.0), (*finish.second_rgb, 1.0)
    middle = stops.new(0.49)
    middle.color = (0.62, 0.54, 0.40, 1.0)
    tree.links.new(noise.outputs["Factor"], ramp.inputs["Factor"])
    _paint(tree, ramp.outputs["Color"], node)


_PAINTERS: dict[Pattern, Callable[[_Tree, Finish, bpy.types.Node], None]] = {
    Pattern.PLAIN: _plain,
    Pattern.MOTTLED: _mottled,
    Pattern.PATCHES: _patches,
    Pattern.PLANKS: _planks,
    Pattern.TILES: _tiles,
    Pattern.WINDOWS: _windows,
    Pattern.VEINS: _veins,
    Pattern.WAVES: _waves,
    Pattern.PICTURE: _picture,
}


def _bricks(
    tree: _Tree, finish: Finish, *, width: float, height: float, gap: float
) -> bpy.types.Node:
    brick = tree.nodes.new("ShaderNodeTexBrick")
    brick.inputs["Scale"].default_value = 1.0
    brick.inputs["Brick Width"].default_value = width
    brick.inputs["Row Height"].default_value = height
    brick.inputs["Mortar Size"].default_value = gap
    brick.inputs["Color1"].default_value = (*finish.rgb, 1.0)
    brick.inputs["Color2"].default_value = (*finish.second_rgb, 1.0)
    tree.links.new(_uv(tree), brick.inputs["Vector"])
    return brick


def _paint(tree: _Tree, colour: _Socket, node: bpy.types.Node) -> None:
    tree.links.new(colour, node.inputs["Base Color"])


def _position(tree: _Tree) -> _Socket:
    return tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]


def _uv(tree: _Tree) -> _Socket:
    return tree.nodes.new("ShaderNodeUVMap").outputs["UV"]


def _scaled_uv(tree: _Tree, scale: Rgb) -> _Socket:
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = scale
    tree.links.new(_uv(tree), mapping.inputs["Vector"])
    return mapping.outputs["Vector"]


def _noise(
    tree: _Tree, where: _Socket, scale: float, *, detail: float, roughness: float
) -> _Socket:
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = scale
    noise.inputs["Detail"].default_value = detail
    noise.inputs["Roughness"].default_value = roughness
    tree.links.new(where, noise.inputs["Vector"])
    return noise.outputs["Factor"]


def _white_noise(tree: _Tree, where: _Socket) -> _Socket:
    node = tree.nodes.new("ShaderNodeTexWhiteNoise")
    tree.links.new(where, node.inputs["Vector"])
    return node.outputs["Value"]


def _stretched(tree: _Tree, value: _Socket, low: float, high: float) -> _Socket:
    node = tree.nodes.new("ShaderNodeMapRange")
    node.inputs["From Min"].default_value = low
    node.inputs["From Max"].default_value = high
    tree.links.new(value, node.inputs["Value"])
    return node.outputs["Result"]


def _mixed(tree: _Tree, share: _Socket, finish: Finish) -> _Socket:
    mix = tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    mix.inputs[6].default_value = (*finish.rgb, 1.0)
    mix.inputs[7].default_value = (*finish.second_rgb, 1.0)
    tree.links.new(share, mix.inputs[0])
    return mix.outputs[2]


def _shaded(tree: _Tree, colour: _Socket, noise: _Socket, low: float, high: float) -> _Socket:
    level = tree.nodes.new("ShaderNodeMapRange")
    level.inputs["From Min"].default_value = 0.25
    level.inputs["From Max"].default_value = 0.75
    level.inputs["To Min"].default_value = low
    level.inputs["To Max"].default_value = high
    tree.links.new(noise, level.inputs["Value"])
    scale = tree.nodes.new("ShaderNodeVectorMath")
    scale.operation = "SCALE"
    tree.links.new(colour, scale.inputs[0])
    tree.links.new(level.outputs["Result"], scale.inputs["Scale"])
    return scale.outputs["Vector"]
