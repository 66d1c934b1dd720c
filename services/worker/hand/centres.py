"""Centres of rotation for skinning: where each vertex turns about when its bones disagree.

Le and Hodgins, "Real-time skeletal skinning with optimized centers of rotation", SIGGRAPH 2016.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from services.worker.hand.asset import F8, I4

SIMILARITY_WIDTH = 0.1
"""Sigma of the paper: how alike two sets of weights must be to count as one cross-section."""


@dataclass(frozen=True, eq=False)
class CentreMap:
    """The centre of each vertex as a mean of the middles of triangles: linear in the vertices.

    faces (T,3); shared (V,): more than one bone moves the vertex, whose row of shares (S,T) sums
    to 1. A vertex that one bone owns is its own centre.
    """

    faces: I4
    shared: npt.NDArray[np.bool_]
    shares: F8

    @classmethod
    def of(cls, vertices_m: F8, faces: I4, weights: F8) -> "CentreMap":
        """Equation 1 of the paper over triangles (T,3), with the areas of these vertices.

        The centre is the mean of the surface whose weights are similar: for the skin round a
        finger joint, the middle of the finger there.
        """
        corners = vertices_m[faces]
        edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = np.linalg.norm(np.cross(*edges), axis=1) / 2.0
        similarity = _similarity(weights, weights[faces].mean(axis=1)) * area
        total = similarity.sum(axis=1)
        shared = total > 1e-12 * area.sum()
        return cls(faces, shared, similarity[shared] / total[shared, None])

    def apply(self, vertices_m: F8) -> F8:
        """Centres (V,3) of vertices (V,3), or how they shift where those shift."""
        centres = vertices_m.copy()
        # einsum, not BLAS: the sum must not depend on the number of threads.
        centres[self.shared] = np.einsum(
            "vt,tk->vk", self.shares, vertices_m[self.faces].mean(axis=1)
        )
        return centres


def _similarity(weights: F8, others: F8) -> F8:
    """(V,T) similarity of weight vectors, equation 2 of the paper."""
    similarity = np.zeros((len(weights), len(others)))
    for j, k in np.argwhere(np.triu((weights.T @ weights) > 0, 1)):
        rows = np.flatnonzero(weights[:, j] * weights[:, k])
        columns = np.flatnonzero(others[:, j] * others[:, k])
        a, b = weights[rows, j][:, None], weights[rows, k][:, None]
        c, d = others[columns, j], others[columns, k]
        bell = np.exp(-(((a * d - b * c) / SIMILARITY_WIDTH) ** 2))
        similarity[np.ix_(rows, columns)] += 2.0 * a * b * c * d * bell
    return similarity
