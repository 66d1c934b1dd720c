"""A node tree's small words: make a node with every setting named, link it, hand back sockets."""

from dataclasses import dataclass

import bpy

type Socket = bpy.types.NodeSocket
type Channels = tuple[Socket, Socket, Socket, Socket]


@dataclass(frozen=True)
class Graph:
    """Builds nodes in one tree."""

    tree: bpy.types.NodeTree

    def link(self, source: Socket, target: Socket) -> None:
        """Feed an output into an input."""
        self.tree.links.new(source, target)

    def uv(self, layer: str) -> Socket:
        """Return texture coordinates of a named layer."""
        node = self.tree.nodes.new("ShaderNodeUVMap")
        node.from_instancer = False
        node.uv_map = layer
        return node.outputs["UV"]

    def attribute(self, name: str) -> Socket:
        """Return a number that the mesh carries per vertex."""
        node = self.tree.nodes.new("ShaderNodeAttribute")
        node.attribute_type = "GEOMETRY"
        node.attribute_name = name
        return node.outputs["Fac"]

    def picture(self, uv: Socket, interpolation: str) -> bpy.types.Node:
        """Add an image texture; its image is set later."""
        node = self.tree.nodes.new("ShaderNodeTexImage")
        node.interpolation = interpolation
        node.projection = "FLAT"
        node.extension = "EXTEND"
        self.link(uv, node.inputs["Vector"])
        return node

    def channels(self, picture: bpy.types.Node) -> Channels:
        """Return a picture's red, green, blue and alpha."""
        node = self.tree.nodes.new("ShaderNodeSeparateColor")
        node.mode = "RGB"
        self.link(picture.outputs["Color"], node.inputs["Color"])
        red, green, blue = (node.outputs[name] for name in ("Red", "Green", "Blue"))
        return red, green, blue, picture.outputs["Alpha"]

    def math(self, operation: str) -> bpy.types.Node:
        """Add a node of scalar arithmetic."""
        node = self.tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        node.use_clamp = False
        return node

    def vector_math(self, operation: str) -> bpy.types.Node:
        """Add a node of arithmetic on three numbers at once."""
        node = self.tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        return node

    def bump(self, distance_m: float, filter_width_px: float) -> bpy.types.Node:
        """Add a node that bends normals by a height in units of `distance_m`."""
        node = self.tree.nodes.new("ShaderNodeBump")
        node.invert = False
        node.inputs["Strength"].default_value = 1.0
        node.inputs["Distance"].default_value = distance_m
        node.inputs["Filter Width"].default_value = filter_width_px
        return node
