import numpy as np
import pytest

from services.worker.label.projected import project_mesh
from services.worker.label.raster import NO_TRIANGLE, rasterise
from tests.unit.worker.label.shapes import CAMERA, LENS, box, scene_of


def test_a_box_covers_the_pixel_centres_its_front_face_covers() -> None:
    geometry = scene_of([box((0.0, 0.0, 1.0), (0.1, 0.05, 0.2))], [0])
    surface = rasterise(project_mesh(CAMERA, geometry))
    # The front face lies at 0.8 m: 31.5 ± 12.5 by 20.25 ± 5 pixels.
    rows, columns = np.indices((LENS.height_px, LENS.width_px)) + 0.5
    wanted = (np.abs(columns - 31.5) <= 12.5) & (np.abs(rows - 20.25) <= 5.0)
    assert (surface.covered == wanted).all()
    assert surface.depth_m[wanted] == pytest.approx(0.8)
    assert np.isinf(surface.depth_m[~wanted]).all()
    assert (surface.triangle[~wanted] == NO_TRIANGLE).all()


def test_depth_and_weights_are_right_on_a_slanted_face() -> None:
    corners = box((0.0, 0.0, 1.0), (0.2, 0.2, 0.1))
    corners[:, 2] += 0.7 * corners[:, 0] + 0.3 * corners[:, 1]
    mesh = project_mesh(CAMERA, scene_of([corners], [0]))
    surface = rasterise(mesh)
    rows, columns = np.nonzero(surface.covered)
    points = mesh.vertices_camera_m[mesh.triangles[surface.triangle[rows, columns]]]
    seen = (surface.weights[rows, columns][..., None] * points).sum(axis=1)
    assert seen[:, 2] == pytest.approx(surface.depth_m[rows, columns])
    assert LENS.fx_px * seen[:, 0] / seen[:, 2] + LENS.cx_px == pytest.approx(columns + 0.5)
    assert LENS.fy_px * seen[:, 1] / seen[:, 2] + LENS.cy_px == pytest.approx(rows + 0.5)


def test_the_nearer_surface_wins_in_either_order() -> None:
    near, far = box((0.0, 0.0, 0.6), (0.02, 0.02, 0.01)), box((0.0, 0.0, 1.0), (0.3, 0.3, 0.1))
    for boxes, parts in (([near, far], [3, 7]), ([far, near], [7, 3])):
        geometry = scene_of(boxes, parts)
        mesh = project_mesh(CAMERA, geometry)
        surface = rasterise(mesh)
        part = geometry.part[surface.nearest_vertex]
        assert part[20, 31] == 3
        assert part[20, 45] == 7


def test_big_and_small_triangles_give_the_same_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = project_mesh(CAMERA, scene_of([box((0.1, 0.0, 0.5), (0.3, 0.2, 0.1))], [0]))
    whole = rasterise(mesh)
    monkeypatch.setattr("services.worker.label.scan.CHUNK", 7)
    assert (rasterise(mesh).triangle == whole.triangle).all()


def test_what_is_behind_the_camera_is_not_seen() -> None:
    mesh = project_mesh(CAMERA, scene_of([box((0.0, 0.0, -1.0), (0.1, 0.1, 0.1))], [0]))
    assert np.isnan(mesh.vertices_px).all()
    assert not rasterise(mesh).covered.any()
