import numpy as np
import pytest

from hi5_common.domain.labels import Box
from services.worker.label.box import tight_box
from services.worker.label.projected import project_mesh
from services.worker.label.projection import F8
from services.worker.label.raster import rasterise
from services.worker.label.region import FILTER_MARGIN_PX, touched_region
from services.worker.scene.types import Camera, Intrinsics
from tests.unit.worker.label.shapes import CAMERA, LENS, box, scene_of


def _box(corners: F8) -> Box | None:
    return tight_box(project_mesh(CAMERA, scene_of([corners], [0])), np.ones(8, dtype=np.bool_))


def _numbers(found: Box | None) -> tuple[float, ...]:
    assert found is not None
    return found.x_px, found.y_px, found.width_px, found.height_px


def test_a_whole_box_is_tight() -> None:
    # The front face at 0.8 m, 31.5 ± 12.5 by 20.25 ± 5 pixels.
    found = _box(box((0.0, 0.0, 1.0), (0.1, 0.05, 0.2)))
    assert _numbers(found) == pytest.approx((19.0, 15.25, 25.0, 10.0))


def test_a_box_that_leaves_the_frame_ends_there() -> None:
    found = _box(box((-0.3, 0.0, 1.0), (0.1, 0.05, 0.2)))
    assert found is not None
    assert found.x_px == 0.0
    assert found.x_px + found.width_px == pytest.approx(31.5 + 100 * -0.2 / 1.2)
    assert found.height_px == pytest.approx(10.0)


def test_a_slanted_edge_is_cut_at_the_frame() -> None:
    corners = box((0.0, 0.0, 1.0), (0.8, 0.02, 0.02))
    corners[:, 1] += 0.5 * corners[:, 0]
    found = _box(corners)
    assert found is not None
    assert (found.x_px, found.width_px) == (0.0, 64.0)
    # At the frame's left edge the bar has only dropped by what its slope says there.
    slope = 0.5 * LENS.fy_px / LENS.fx_px
    assert found.y_px == pytest.approx(20.25 - 31.5 * slope - 0.02 * 80 / 0.98, abs=0.3)


def test_nothing_in_frame_has_no_box_and_no_region() -> None:
    for middle in ((9.0, 0.0, 1.0), (0.0, 0.0, -1.0)):
        mesh = project_mesh(CAMERA, scene_of([box(middle, (0.1, 0.1, 0.1))], [0]))
        assert tight_box(mesh, np.ones(8, dtype=np.bool_)) is None
        assert touched_region(mesh).is_empty


def test_only_the_asked_vertices_count() -> None:
    geometry = scene_of(
        [box((0.0, 0.0, 1.0), (0.1, 0.05, 0.2)), box((0.2, 0.1, 1.0), (0.05, 0.05, 0.05))], [0, 1]
    )
    mesh = project_mesh(CAMERA, geometry)
    first = tight_box(mesh, geometry.part == 0)
    assert _numbers(first) == pytest.approx((19.0, 15.25, 25.0, 10.0))
    assert tight_box(mesh, geometry.part >= 0) != first


@pytest.mark.parametrize("middle", [(0.0, 0.0, 1.0), (-0.3, 0.2, 1.0), (0.31, -0.24, 1.0)])
def test_the_region_holds_every_covered_pixel_and_the_filters_reach(
    middle: tuple[float, float, float],
) -> None:
    mesh = project_mesh(CAMERA, scene_of([box(middle, (0.1, 0.05, 0.2))], [0]))
    region = touched_region(mesh)
    assert region == region.clipped(LENS.width_px, LENS.height_px)
    rows, columns = np.nonzero(rasterise(mesh).covered)
    grown = region.grown(-FILTER_MARGIN_PX)
    for low, high, at, size in (
        (grown.left, grown.right, columns, LENS.width_px),
        (grown.top, grown.bottom, rows, LENS.height_px),
    ):
        assert at.min() >= min(low, max(region.left, 0)) or at.min() == 0
        assert at.max() < high or at.max() == size - 1


def test_a_far_hand_still_gets_blenders_smallest_picture() -> None:
    lens = Intrinsics(100.0, 100.0, 8.0, 8.0, 16, 16)
    corner = box((-0.0795, -0.0795, 1.0), (0.0005, 0.0005, 0.0005))
    region = touched_region(project_mesh(Camera(lens, np.eye(4)), scene_of([corner], [0])))
    assert region.width >= 4
    assert region.height >= 4
