"""What can hide a keypoint, by vertex of the projected mesh: parts of the hand, then ornaments."""

import numpy as np
import numpy.typing as npt

from services.worker.hand.parts import PARTS, HandPart
from services.worker.ornaments.mesh import OrnamentName
from services.worker.scene.types import SceneGeometry

OCCLUDERS: tuple[HandPart | OrnamentName, ...] = (*PARTS, *OrnamentName)
"""Index in this tuple is the value of `occluder_of`; the hand's parts keep theirs."""

FOREARM = PARTS.index(HandPart.FOREARM)


def occluder_of(geometry: SceneGeometry) -> npt.NDArray[np.int32]:
    """Return (N,) an index into OCCLUDERS for each vertex of project_mesh(camera, geometry)."""
    worn = [
        np.full(len(ornament.vertices_m), OCCLUDERS.index(ornament.name), dtype=np.int32)
        for ornament in geometry.ornaments
    ]
    return np.concatenate([geometry.part, *worn])


def is_hand(occluder: npt.NDArray[np.int32]) -> npt.NDArray[np.bool_]:
    """Return (N,) whether a vertex is skin of the hand: neither forearm nor ornament."""
    hand: npt.NDArray[np.bool_] = (occluder != FOREARM) & (occluder < len(PARTS))
    return hand
