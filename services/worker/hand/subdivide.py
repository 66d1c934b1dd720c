"""Catmull-Clark subdivision of the closed hand mesh as a sparse linear map, built once.

Catmull and Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes", 1978.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8, I4
from services.worker.hand.model import F4, HandModel

I8 = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Subdivision:
    """A refinement of one mesh topology.

    quads (G,4) i4, uvs (G,4,2) f4, of the fine mesh with W vertices. Row w of the map is
    sum(values[k] * control[columns[k]]) for k in starts[w]..starts[w+1].
    """

    quads: I4
    uvs: F4
    starts: I4
    columns: I4
    values: F8
    control_count: int
    """V, the number of control vertices."""

    @property
    def vertex_count(self) -> int:
        return len(self.starts) - 1

    def apply(self, control: F8) -> F8:
        """Fine values (W,...) of control values (V,...): positions (V,3) or a scalar (V,).

        Affine: constants stay, and the fine surface lies in the convex hull of the control mesh.
        """
        terms = control[self.columns] * self.values.reshape(-1, *(1,) * (control.ndim - 1))
        return np.add.reduceat(terms, self.starts[:-1], axis=0)

    def owners(self, control: I4) -> I4:
        """Fine labels (W,) of control labels (V,): the label of the heaviest control vertex."""
        lengths = np.diff(self.starts)
        row = np.repeat(np.arange(self.vertex_count), lengths)
        order = np.lexsort((self.columns, -self.values, row))
        return control[self.columns[order[self.starts[:-1]]]]


def subdivision(model: HandModel, levels: int) -> Subdivision:
    """Catmull-Clark of the model's topology; levels 0 gives the control mesh itself.

    ValueError for negative levels. UVs are refined linearly, so texture seams stay put.
    """
    if levels < 0:
        raise ValueError(f"levels is {levels}; it must be 0 or more")
    return refined(len(model.vertices_m), model.quads, model.uvs, levels)


def refined(vertex_count: int, quads: I4, uvs: F4, levels: int) -> Subdivision:
    """Catmull-Clark of any closed quad mesh: quads (F,4), uvs (F,4,2)."""
    total = _Sparse.identity(vertex_count)
    for _ in range(levels):
        step, quads = _step(total.height, quads)
        total = step.times(total)
        uvs = _split_uvs(uvs)
    return Subdivision(quads, uvs, total.starts, total.columns, total.values, vertex_count)


@dataclass(frozen=True, eq=False)
class _Sparse:
    """A matrix in compressed rows, columns ascending in each row."""

    starts: I4
    columns: I4
    values: F8
    width: int

    @property
    def height(self) -> int:
        return len(self.starts) - 1

    @classmethod
    def identity(cls, size: int) -> "_Sparse":
        rows = np.arange(size)
        return cls.gathered(rows, rows, np.ones(size), (size, size))

    @classmethod
    def gathered(cls, rows: I8, columns: I8, values: F8, shape: tuple[int, int]) -> "_Sparse":
        """The matrix of entries in any order; equal places are summed."""
        keys, place = np.unique(rows * shape[1] + columns, return_inverse=True)
        starts = np.searchsorted(keys, np.arange(shape[0] + 1) * shape[1])
        sums = np.bincount(place, weights=values)
        return cls(starts.astype(np.int32), (keys % shape[1]).astype(np.int32), sums, shape[1])

    def times(self, other: "_Sparse") -> "_Sparse":
        """The matrix product self · other."""
        lengths = np.diff(other.starts)[self.columns]
        ends = np.cumsum(lengths)
        within = np.arange(ends[-1]) - np.repeat(ends - lengths, lengths)
        source = np.repeat(other.starts[self.columns], lengths) + within
        rows = np.repeat(np.repeat(np.arange(self.height), np.diff(self.starts)), lengths)
        values = np.repeat(self.values, lengths) * other.values[source]
        columns = other.columns[source].astype(np.int64)
        return _Sparse.gathered(rows, columns, values, (self.height, other.width))


def _step(count: int, quads: I4) -> tuple[_Sparse, I4]:
    """One level: its map, rows ordered as old vertices, edge points, face points; fine quads."""
    corners = quads.astype(np.int64)
    following = np.roll(corners, -1, axis=1)
    keys = np.minimum(corners, following) * count + np.maximum(corners, following)
    edges, of_edge = np.unique(keys, return_inverse=True)
    of_edge = of_edge.reshape(quads.shape)
    edge_row = count + of_edge
    face_row = np.broadcast_to((count + len(edges) + np.arange(len(quads)))[:, None], quads.shape)
    entries = [_face_entries(corners, face_row), _edge_entries(corners, edge_row)]
    entries.append(_vertex_entries(corners, following, count))
    rows, columns, values = (np.concatenate(part) for part in zip(*entries, strict=True))
    shape = (count + len(edges) + len(quads), count)
    fine = np.stack([corners, edge_row, face_row, np.roll(edge_row, 1, axis=1)], axis=2)
    return _Sparse.gathered(rows, columns, values, shape), fine.reshape(-1, 4).astype(np.int32)


Entries = tuple[I8, I8, F8]


def _face_entries(corners: I8, face_row: I8) -> Entries:
    """A face point is the mean of its corners."""
    return face_row.reshape(-1), corners.reshape(-1), np.full(corners.size, 0.25)


def _edge_entries(corners: I8, edge_row: I8) -> Entries:
    """An edge point is the mean of its ends and of the face points on both sides.

    Each of the two faces adds a quarter of its own face point and half of the ends' quarters.
    """
    weights = np.array([0.0625 + 0.125, 0.0625 + 0.125, 0.0625, 0.0625])
    columns = np.stack([np.roll(corners, -k, axis=1) for k in range(4)], axis=2)
    rows = np.broadcast_to(edge_row[:, :, None], columns.shape)
    values = np.broadcast_to(weights, columns.shape)
    return rows.reshape(-1), columns.reshape(-1), values.reshape(-1)


def _vertex_entries(corners: I8, following: I8, count: int) -> Entries:
    """An old vertex of valence n: ((n - 2) itself + mean of neighbours + mean of faces) / n.

    On a closed mesh every neighbour follows the vertex in exactly one face.
    """
    valence = np.bincount(corners.reshape(-1), minlength=count).astype(np.float64)
    own = np.arange(count)
    itself = (own, own, (valence - 2.0) / valence)
    rows = corners.reshape(-1)
    neighbours = (rows, following.reshape(-1), 1.0 / valence[rows] ** 2)
    face_rows = np.repeat(rows, 4)
    faces = (face_rows, np.repeat(corners, 4, axis=0).reshape(-1), 0.25 / valence[face_rows] ** 2)
    parts = (np.concatenate(part) for part in zip(itself, neighbours, faces, strict=True))
    return next(parts), next(parts), next(parts)


def _split_uvs(uvs: F4) -> F4:
    """(4F,4,2) of (F,4,2): each quad's own corner, edge middle, centre, edge middle."""
    after = (uvs + np.roll(uvs, -1, axis=1)) / 2.0
    centre = np.broadcast_to(uvs.mean(axis=1, keepdims=True), uvs.shape)
    fine = np.stack([uvs, after, centre, np.roll(after, 1, axis=1)], axis=2)
    return fine.reshape(-1, 4, 2).astype(np.float32)
