"""Skin weights and skin maps per vertex: forearm twist, parts, nails, palm."""

import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8, I4
from services.worker.hand.bones import BONE_INDEX, BONES, FOREARM_GROUPS, FOREARM_TWISTS
from services.worker.hand.parts import PARTS, HandPart
from services.worker.hand.rest import DIGITS
from services.worker.hand.rotation import unit

TWIST_STATIONS = (0.15, 0.4, 0.65, 0.9)
"""Where along the forearm (0 elbow, 1 wrist) each forearm bone holds the skin alone."""
PALM_COSINE = (-0.25, 0.25)
"""The border of glabrous skin: from none to all over this range of cosine to the palmar way."""
TIP_COSINE = (0.35, 0.85)
"""Skin that faces out of the end of a finger is glabrous too, up to the nail."""
WRIST_CREASE_M = (-0.045, 0.022)
"""The palm's skin begins over this range along the hand; a sharper border looks like a glove."""

WEIGHT_GROUPS: tuple[str, ...] = (
    *FOREARM_GROUPS,
    *(group for bone in BONES for group in bone.weight_groups),
)

WEB_PARTS = [
    PARTS.index(part)
    for part in (HandPart.PALM, HandPart.THUMB_METACARPAL, HandPart.THUMB_PROXIMAL)
]
WEB_SMOOTHINGS = 8


def smoothstep(low: float, high: float, value: F8) -> F8:
    """0 below low, 1 above high, and a smooth cubic between."""
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    smooth: F8 = t * t * (3.0 - 2.0 * t)
    return smooth


def bone_weights(filed: F8, along: F8) -> F8:
    """Skin weights (V,B) with rows that sum to 1.

    filed (V, len(WEIGHT_GROUPS)): the asset's weights; along (V,): position on the forearm,
    0 elbow to 1 wrist, by which its share is spread over the twisting forearm bones.
    """
    weights = np.zeros((len(filed), len(BONES)))
    forearm = filed[:, : len(FOREARM_GROUPS)].sum(axis=1)
    stations = len(FOREARM_TWISTS)
    for station in range(stations):
        hat = np.interp(along, TWIST_STATIONS, np.eye(stations)[station])
        weights[:, station] = forearm * hat
    for column, group in enumerate(WEIGHT_GROUPS[len(FOREARM_GROUPS) :], len(FOREARM_GROUPS)):
        owner = next(i for i, bone in enumerate(BONES) if group in bone.weight_groups)
        weights[:, owner] += filed[:, column]
    normalised: F8 = weights / weights.sum(axis=1, keepdims=True)
    return normalised


def web_smoothed(weights: F8, quads: I4) -> F8:
    """The weights (V,B) with those about the thumb's web averaged over neighbouring vertices.

    The asset's weights change so fast there that an opposed thumb leaves a pit in the skin.
    """
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    valence = np.bincount(edges[:, 0], minlength=len(weights))[:, None]
    web = _about_thumb(weights, edges) & np.isin(vertex_parts(weights), WEB_PARTS)
    web &= weights[:, BONE_INDEX["thumb_distal"]] < 0.01  # its joint keeps the asset's weights
    smooth = weights.copy()
    for _ in range(WEB_SMOOTHINGS):
        neighbours = np.zeros_like(smooth)
        np.add.at(neighbours, edges[:, 0], smooth[edges[:, 1]])
        smooth[web] = (smooth[web] + (neighbours / valence)[web]) / 2.0
    normalised: F8 = smooth / smooth.sum(axis=1, keepdims=True)
    return normalised


def _about_thumb(weights: F8, edges: I4) -> npt.NDArray[np.bool_]:
    """Vertices that the thumb moves, and two rings of neighbours."""
    thumb = [BONE_INDEX["thumb_metacarpal"], BONE_INDEX["thumb_proximal"]]
    near: npt.NDArray[np.bool_] = weights[:, thumb].sum(axis=1) > 0.02
    for _ in range(2):
        near[edges[near[edges[:, 0]], 1]] = True
    return near


def vertex_parts(weights: F8) -> I4:
    """Index (V,) into PARTS of the segment that holds most of each vertex."""
    shares = np.zeros((len(weights), len(PARTS)))
    for index, bone in enumerate(BONES):
        shares[:, PARTS.index(bone.part)] += weights[:, index]
    return np.argmax(shares, axis=1).astype(np.int32)


def nail_map(quads: I4, nails: npt.NDArray[np.bool_], count: int) -> F8:
    """(V,) 1 on every corner of a nail quad, else 0."""
    nail = np.zeros(count)
    nail[quads[nails]] = 1.0
    return nail


def palm_map(vertices_m: F8, normals: F8, weights: F8, ways: F8, hinges: F8) -> F8:
    """(V,) share 0..1 of glabrous skin: palm, palmar sides and ends of the digits.

    ways (B,3): unit bone directions at rest; hinges (5,3).
    """
    dorsal = np.tile([0.0, 0.0, 1.0], (len(BONES), 1))
    outward = np.zeros((len(BONES), 3))
    for digit, hinge in zip(DIGITS, hinges, strict=True):
        for segment in ("proximal", "middle", "distal"):
            row = BONE_INDEX.get(f"{digit}_{segment}")
            if row is not None:
                dorsal[row] = unit(np.cross(ways[row], hinge))
        row = BONE_INDEX[f"{digit}_distal"]
        outward[row] = ways[row]
    palmar = smoothstep(*PALM_COSINE, -np.einsum("vk,vk->v", normals, unit(weights @ dorsal)))
    tip = smoothstep(*TIP_COSINE, np.einsum("vk,vk->v", normals, weights @ outward))
    palm: F8 = np.maximum(palmar, tip) * smoothstep(*WRIST_CREASE_M, vertices_m[:, 1])
    return palm
