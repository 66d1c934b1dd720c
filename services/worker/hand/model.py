"""The compiled hand: geometry, skin weights, skin maps and keypoints at rest."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender, Handedness

F8 = npt.NDArray[np.float64]
F4 = npt.NDArray[np.float32]
I4 = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class HandModel:
    """A hand with its forearm at rest. Metres, float64.

    Frame of a right hand: origin at the wrist joint, +x ulnar, +y along the middle-finger axis
    (distal), +z dorsal. A left hand is its exact mirror image in x: there +x is radial.
    Shapes: V vertices, F quads, B bones.
    """

    gender: Gender
    handedness: Handedness
    vertices_m: F8
    """(V,3) closed control mesh at rest."""
    quads: I4
    """(F,4) wound counter-clockwise seen from outside."""
    uvs: F4
    """(F,4,2) per corner."""
    weights: F8
    """(V,B) skin weights, rows sum to 1."""
    rotation_centres_m: F8
    """(V,3) what each vertex turns about where its bones disagree."""
    bone_names: tuple[str, ...]
    parents: I4
    """(B,) row of the parent, -1 for the root (forearm)."""
    bone_heads_m: F8
    """(B,3)"""
    bone_tails_m: F8
    """(B,3)"""
    hinges: F8
    """(5,3) unit flexion axis of thumb, index, middle, ring, little finger of a RIGHT hand."""
    rest_angles_deg: F8
    """(26,) absolute joint angles of the rest pose, in the order of ANGLE_NAMES."""
    nail: F8
    """(V,) 0..1"""
    palm: F8
    """(V,) 0..1 glabrous skin: palm, palmar side and end of the digits."""
    forearm: npt.NDArray[np.bool_]
    """(V,) proximal of the wrist."""
    keypoints_m: F8
    """(21,3) at rest, each in the middle of its cross-section."""
    keypoint_weights: F8
    """(21,B) rows sum to 1."""
    part: I4
    """(V,) index into parts.PARTS."""
    correctives_m: F8
    """(C,V,3) what bending adds to the skin at rest, in the order of flesh.CORRECTIVES."""
    content_hash: str
    """Hexadecimal SHA-256 of what the hand was made from: family, shape, side."""

    def hand_quads(self) -> I4:
        """Return the quads (G, 4) of the hand alone, without the forearm and the wrist's edge."""
        return self.quads[~self.forearm[self.quads].any(axis=1)]

    def mirrored(self) -> "HandModel":
        """The other hand: x negated, winding reversed, texture coordinates kept per vertex."""
        other = Handedness.LEFT if self.handedness is Handedness.RIGHT else Handedness.RIGHT
        flip = np.array([-1.0, 1.0, 1.0])
        return replace(
            self,
            handedness=other,
            vertices_m=self.vertices_m * flip,
            quads=np.ascontiguousarray(self.quads[:, ::-1]),
            uvs=np.ascontiguousarray(self.uvs[:, ::-1]),
            rotation_centres_m=self.rotation_centres_m * flip,
            bone_heads_m=self.bone_heads_m * flip,
            bone_tails_m=self.bone_tails_m * flip,
            keypoints_m=self.keypoints_m * flip,
            correctives_m=self.correctives_m * flip,
            content_hash=_other_side(self.content_hash),
        )


def _other_side(content_hash: str) -> str:
    """The hash of the mirrored hand: every bit turned, so that twice is the same hand."""
    return "".join(f"{15 - int(digit, 16):x}" for digit in content_hash)


COMPILER_VERSION = "11"
"""Raised with every change that alters a compiled hand."""
