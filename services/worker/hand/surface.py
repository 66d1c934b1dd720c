"""Geometry of the hand's skin: triangles, normals, rays, sections."""

from dataclasses import dataclass, replace

import numpy as np

from services.worker.hand.asset import F8, I4
from services.worker.hand.rotation import unit


def triangles(quads: I4) -> I4:
    """(2F,3) the quads (F,4) split along their first diagonal."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def vertex_normals(vertices_m: F8, quads: I4) -> F8:
    """Area-weighted unit normals (V,3)."""
    corners = vertices_m[quads]
    faces = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normals = np.zeros_like(vertices_m)
    np.add.at(normals, quads.reshape(-1), np.repeat(faces, 4, axis=0))
    return unit(normals)


def ray_hits(origin_m: F8, directions: F8, vertices_m: F8, faces: I4) -> F8:
    """Sorted distances (R,T) in metres at which rays from one origin meet triangles (T,3)."""
    return np.sort(ray_distances(origin_m, directions, vertices_m, faces), axis=1)


def ray_distances(origin_m: F8, directions: F8, vertices_m: F8, faces: I4) -> F8:
    """Distance (R,T) in metres along each ray from one origin to each triangle (T,3).

    inf where they do not meet (Möller and Trumbore 1997, both sides counted).
    """
    corners = vertices_m[faces]
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(edge1, edge2)
    offset = origin_m - corners[:, 0]
    det = -directions @ normal.T
    turned = np.cross(offset, directions[:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("tk,rtk->rt", edge2, turned) / det
        v = -np.einsum("tk,rtk->rt", edge1, turned) / det
        distance = np.einsum("tk,tk->t", offset, normal) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    return np.where(hit, distance, np.inf)


def winding_numbers(points_m: F8, vertices_m: F8, faces: I4) -> F8:
    """Winding number (N,) of a closed surface about points (N,3): 1 inside, 0 outside.

    Van Oosterom and Strackee 1983. Where skin overlaps skin the number is 2.
    """
    a, b, c = np.moveaxis(vertices_m[faces][:, :, None] - points_m, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    numerator = np.einsum("tnk,tnk->tn", a, np.cross(b, c))
    dots = [np.einsum("tnk,tnk->tn", p, q) for p, q in ((a, b), (b, c), (c, a))]
    denominator = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    winding: F8 = np.arctan2(numerator, denominator).sum(axis=0) / (2.0 * np.pi)
    return winding


def volume_m3(vertices_m: F8, faces: I4) -> float:
    """Signed volume of a closed surface, positive when it is wound outward."""
    a, b, c = np.moveaxis(vertices_m[faces], 1, 0)
    return float(np.einsum("tk,tk->", a, np.cross(b, c)) / 6.0)


@dataclass(frozen=True, eq=False)
class Section:
    """A point in the middle of a limb, and the skin round it that it is the middle of.

    centre_m (3,); faces (N,3) the triangles that hold the outline's points, as vertex rows;
    shares (N,3) barycentric coordinates of the points in them; points_m (N,3).
    """

    centre_m: F8
    faces: I4
    shares: F8
    points_m: F8


def skin_about(centre_m: F8, directions: F8, vertices_m: F8, faces: I4) -> Section:
    """What rays (N,3) from a point inside the limb meet first; the middle is the point itself."""
    reach = ray_distances(centre_m, directions, vertices_m, faces)
    nearest = np.argmin(reach, axis=1)
    points_m = centre_m + reach[np.arange(len(nearest)), nearest, None] * directions
    met = faces[nearest]
    return Section(centre_m, met, _barycentric(points_m, vertices_m[met]), points_m)


def _barycentric(points_m: F8, corners_m: F8) -> F8:
    """Coordinates (N,3) of points (N,3) in the planes of triangles (N,3,3)."""
    edge1, edge2 = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    normal = np.cross(edge1, edge2)
    offset = points_m - corners_m[:, 0]
    size = np.einsum("nk,nk->n", normal, normal)
    v = np.einsum("nk,nk->n", np.cross(offset, edge2), normal) / size
    w = np.einsum("nk,nk->n", np.cross(edge1, offset), normal) / size
    return np.stack([1.0 - v - w, v, w], axis=1)


def limb_section(centre_m: F8, normal: F8, vertices_m: F8, faces: I4, rays: int = 96) -> Section:
    """The limb's section through a point across a normal, with its area centroid as middle.

    The outline is what rays from the point meet first, so the section must be star-shaped.
    """
    across = unit(np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))]))
    frame = np.stack([across, np.cross(unit(normal), across)])
    turn = np.linspace(0.0, 2.0 * np.pi, rays, endpoint=False)
    ways = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ frame
    height = np.einsum("vk,k->v", vertices_m - centre_m, normal)[faces]
    crossing = faces[(height.min(axis=1) <= 0.0) & (height.max(axis=1) >= 0.0)]
    section = skin_about(centre_m, ways, vertices_m, crossing)
    outline = (section.points_m - centre_m) @ frame.T
    following = np.roll(outline, -1, axis=0)
    area = outline[:, 0] * following[:, 1] - outline[:, 1] * following[:, 0]
    shift = ((outline + following) * area[:, None]).sum(axis=0) / (3.0 * area.sum())
    return replace(section, centre_m=centre_m + shift @ frame)


def limb_chord(centre_m: F8, direction: F8, vertices_m: F8, faces: I4) -> Section:
    """The skin on either side of a point along a direction, with the point halfway as middle."""
    way = unit(direction)
    chord = skin_about(centre_m, np.stack([way, -way]), vertices_m, faces)
    return replace(chord, centre_m=chord.points_m.mean(axis=0))


def vertex_areas_m2(vertices_m: F8, quads: I4) -> F8:
    """Area (V,) of each vertex: a quarter of every quad that it is a corner of."""
    corners = vertices_m[quads]
    diagonals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    quarter = np.linalg.norm(diagonals, axis=1) / 8.0
    return np.bincount(quads.ravel(), np.repeat(quarter, 4), minlength=len(vertices_m))
