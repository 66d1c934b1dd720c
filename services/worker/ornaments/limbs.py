"""The posed hand as ornaments see it: fingers and the forearm with their frames."""

from dataclasses import dataclass

import numpy as np

from services.worker.hand.bones import BONE_INDEX
from services.worker.hand.parts import PARTS, HandPart
from services.worker.ornaments.mesh import F8, I4
from services.worker.ornaments.section import Frame, Limb

DORSAL = np.array([0.0, 0.0, 1.0])
"""Where the back of either hand looks at rest."""
_KNUCKLE = {"index": 5, "middle": 9, "ring": 13, "pinky": 17}


@dataclass(frozen=True, eq=False)
class PosedLimbs:
    """The smooth posed skin in the elbow frame (see hand/pose.py).

    vertices_m (W, 3); quads (G, 4); part (W,) index into PARTS; keypoints_m (21, 3); bones
    (B, 4, 4) from rest.
    """

    vertices_m: F8
    quads: I4
    part: I4
    keypoints_m: F8
    bones: F8

    def phalanx(self, finger: str, along: float) -> tuple[Frame, Limb]:
        """Return the frame in the middle of a proximal phalanx, distal along it, and its skin."""
        name = f"{finger}_proximal"
        limb = self._limb(HandPart(name))
        knuckle, middle = self.keypoints_m[_KNUCKLE[finger] : _KNUCKLE[finger] + 2]
        up = self.bones[BONE_INDEX[name], :3, :3] @ DORSAL
        frame = Frame.of(knuckle + along * (middle - knuckle), middle - knuckle, up)
        return limb.centred(frame), limb

    def forearm(self) -> tuple[Frame, Limb]:
        """Return the frame at the wrist, distal along the forearm, up at its back, and its skin."""
        up = self.bones[BONE_INDEX["forearm_twist_3"], :3, :3] @ DORSAL
        frame = Frame.of(np.zeros(3), np.array([0.0, 1.0, 0.0]), up)
        return frame, self._limb(HandPart.FOREARM)

    def _limb(self, part: HandPart) -> Limb:
        return Limb.of(self.vertices_m, self.quads, self.part == PARTS.index(part))
