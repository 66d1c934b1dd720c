"""Cuts the right forearm and hand out of the base mesh and closes the cut with quads.

Topology is decided on the unmorphed base mesh, so every gender has the same one.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from hi5_common.domain.errors import PermanentError
from services.worker.hand.asset import F8, I4, BaseMesh

CUT = 0.12
"""Faces are kept whose corners all lie further than this share from elbow to wrist: the bumps of
the elbow are left out, and what comes before them is a plain tube."""
RINGS = (0.09, 0.06, 0.03, 0.01, 0.0)
"""Where the rings of the arm's plain tube lie, as shares from elbow to wrist; the last one is the
edge of its flat end."""
RING_SMOOTHINGS = (3, 8, 16, 24, 24)
"""The cut follows the mesh in zigzags; so many averages along each ring round them off."""
END_INSET = 0.8
"""Radius of the ring on the flat end that keeps its edge tight under subdivision."""


class HandMeshUnusable(PermanentError):
    """The base mesh cannot be cut at the forearm as expected."""


@dataclass(frozen=True, eq=False)
class CutMesh:
    """A closed quad mesh whose vertices are rows of the base mesh, then those of the arm's tube.

    source (S,) base row of the first S vertices; boundary (N,) the open loop among them, in the
    order in which the cap runs; quads (F,4); uvs (F,4,2).
    """

    source: I4
    boundary: I4
    quads: I4
    uvs: F8


def cut_forearm(mesh: BaseMesh, elbow: F8, wrist: F8, fingertip: F8) -> CutMesh:
    """The faces distal of the elbow that hang together with the fingertip, closed by a cap.

    elbow, wrist, fingertip: points in the base mesh's own unit and frame.
    """
    axis = (wrist - elbow) / np.sum((wrist - elbow) ** 2)
    along = (mesh.vertices - elbow) @ axis
    candidates = np.flatnonzero((along[mesh.quads] > CUT).all(axis=1))
    distance = np.linalg.norm(
        mesh.vertices[mesh.quads[candidates]].mean(axis=1) - fingertip, axis=1
    )
    faces = candidates[_connected(mesh.quads[candidates], int(np.argmin(distance)))]
    source, local = np.unique(mesh.quads[faces], return_inverse=True)
    quads = local.reshape(-1, 4).astype(np.int32)
    boundary, loop_uvs = _open_loop(quads, mesh.uvs[faces])
    cap_quads, cap_uvs = _cap(boundary, loop_uvs, first_new=len(source))
    return CutMesh(
        source.astype(np.int32),
        boundary,
        np.concatenate([quads, cap_quads]),
        np.concatenate([mesh.uvs[faces], cap_uvs]),
    )


def _connected(quads: I4, seed: int) -> npt.NDArray[np.bool_]:
    """Faces that can be reached from the seed face over shared vertices."""
    reached = np.zeros(int(quads.max()) + 1, dtype=np.bool_)
    reached[quads[seed]] = True
    while True:
        faces = reached[quads].any(axis=1)
        count = int(reached.sum())
        reached[quads[faces]] = True
        if int(reached.sum()) == count:
            return faces


def _open_loop(quads: I4, uvs: F8) -> tuple[I4, F8]:
    """The single open loop, against the winding of its faces, with UVs (N,2,2) of each edge."""
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    edge_uvs = np.stack([uvs, np.roll(uvs, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    known = {(int(a), int(b)): row for row, (a, b) in enumerate(edges)}
    following = {b: (a, row) for (a, b), row in known.items() if (b, a) not in known}
    start = min(following, default=-1)
    loop: list[int] = []
    rows: list[int] = []
    at = start
    while at != start or not loop:
        if at not in following:
            raise HandMeshUnusable("The forearm cut of the base mesh is not one closed loop.")
        loop.append(at)
        at, row = following[at]
        rows.append(row)
    if len(loop) != len(following) or len(loop) % 2:
        raise HandMeshUnusable("The forearm cut of the base mesh is not one even loop.")
    return np.array(loop, dtype=np.int32), edge_uvs[rows][:, ::-1]


def _cap(boundary: I4, loop_uvs: F8, first_new: int) -> tuple[I4, F8]:
    """The tube ring by ring, the inset on its flat end, and a fan of quads about the centre."""
    count = len(boundary)
    new = first_new + np.arange((len(RINGS) + 1) * count, dtype=np.int32)
    rings = [boundary, *new.reshape(-1, count)]
    strips = [_strip(*pair) for pair in pairwise(rings)]
    inset, even = rings[-1], np.arange(0, count, 2)
    centre = np.full(len(even), first_new + len(new))
    fan = np.stack(
        [inset[even], inset[even + 1], inset[(even + 2) % count], centre], axis=1
    ).astype(np.int32)
    strip_uvs = loop_uvs[:, [0, 1, 1, 0]]
    fan_uvs = np.stack(
        [loop_uvs[even, 0], loop_uvs[even, 1], loop_uvs[even + 1, 1], loop_uvs[even, 0]], axis=1
    )
    return np.concatenate([*strips, fan]), np.concatenate([strip_uvs] * len(strips) + [fan_uvs])


def _strip(outer: I4, inner: I4) -> I4:
    return np.stack([outer, np.roll(outer, -1), np.roll(inner, -1), inner], axis=1)


def tube_vertices_m(boundary_m: F8, elbow_m: F8, wrist_m: F8) -> F8:
    """Rings, inset ring and centre of the arm's tube: ((R + 1) N + 1, 3) metres."""
    forearm = wrist_m - elbow_m
    length_m = float(np.linalg.norm(forearm))
    axis = forearm / length_m
    rings = []
    for station, smoothings in zip(RINGS, RING_SMOOTHINGS, strict=True):
        ring = _rounded(boundary_m, smoothings)
        along_m = (ring - elbow_m) @ axis
        rings.append(ring + np.outer(station * length_m - along_m, axis))
    centre = rings[-1].mean(axis=0)
    inset = centre + END_INSET * (rings[-1] - centre)
    return np.concatenate([*rings, inset, centre[None]])


def _rounded(ring_m: F8, smoothings: int) -> F8:
    """The ring averaged along itself, and blown up again to the girth that it lost by that."""
    smooth = ring_m
    for _ in range(smoothings):
        smooth = (np.roll(smooth, 1, axis=0) + 2.0 * smooth + np.roll(smooth, -1, axis=0)) / 4.0
    centre = ring_m.mean(axis=0)
    radii = [np.linalg.norm(points - centre, axis=1).mean() for points in (ring_m, smooth)]
    rounded: F8 = centre + (smooth - centre) * (radii[0] / radii[1])
    return rounded
