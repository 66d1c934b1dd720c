"""The plain tube behind the forearm: how far the arm runs before it is cut off."""

from dataclasses import replace

import numpy as np

from services.worker.hand.cut import RINGS
from services.worker.hand.model import F8, HandModel

LONGEST_ARM_M = 1.5


def with_arm(model: HandModel, length_m: float) -> HandModel:
    """The same hand with its arm cut off `length_m` behind the wrist joint, straight.

    The tube's rings are spread evenly along the forearm's own line; nothing else moves, so
    topology, parts and skin of the hand stay. ValueError if shorter than the modelled forearm or
    longer than LONGEST_ARM_M.
    """
    elbow_m = model.bone_heads_m[0]
    shortest_m = float(np.linalg.norm(elbow_m))
    if not shortest_m <= length_m <= LONGEST_ARM_M:
        raise ValueError(
            f"length_m is {length_m}; it must be from {shortest_m:.3f} to {LONGEST_ARM_M}"
        )
    way = elbow_m / shortest_m
    rings = tube_ring_rows(model)
    shift = np.zeros_like(model.vertices_m)
    shares = np.linspace(0.0, 1.0, len(RINGS))
    for share, ring in zip([*shares, 1.0, 1.0], rings, strict=True):
        shift[ring] = share * (length_m - shortest_m) * way
    return _moved(model, shift)


def tube_ring_rows(model: HandModel) -> list[slice]:
    """Rows of the vertices of each ring of the tube, hand to elbow, then the inset and the centre.

    They are the last of the mesh, ring after ring; each quad of the fan about the centre takes two
    vertices of the inset.
    """
    centre = len(model.vertices_m) - 1
    count = 2 * int((model.quads == centre).any(axis=1).sum())
    first = centre - (len(RINGS) + 1) * count
    starts = range(first, centre, count)
    return [*(slice(start, start + count) for start in starts), slice(centre, centre + 1)]


def _moved(model: HandModel, shift_m: F8) -> HandModel:
    return replace(
        model,
        vertices_m=model.vertices_m + shift_m,
        rotation_centres_m=model.rotation_centres_m + shift_m,
    )
