"""With a sleeve the camera may stand far away, and still neither stump nor sleeve's end shows."""

import numpy as np
import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec
from services.worker.label.projection import to_camera, to_pixels
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary
from services.worker.scene.sampling import sample_scene
from services.worker.scene.view import camera_position, in_frame


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


def sleeved(count: int, sleeves: list[str]) -> DatasetSpec:
    # One place that need not be baked: what stands behind the hand changes no view.
    attributes = {"sleeve": sleeves, "environment": ["studio"]}
    return parse_spec({"count": count, "seed": 8, "attributes": attributes})


def test_no_end_of_a_sleeve_shows_and_hands_are_smaller(hands: HandLibrary) -> None:
    spec = sleeved(24, ["shirt", "knit", "jacket"])
    plan, sizes = Plan.of(spec), []
    for index in range(spec.count):
        scene = sample_scene(spec, plan, index, hands)
        geometry = build_geometry(scene, hands)
        cloth_m = np.concatenate([mesh.vertices_m for mesh in geometry.ornaments])
        up_the_arm = (cloth_m - scene.hand_to_world[:3, 3]) @ scene.hand_to_world[:3, 1]
        end_m = cloth_m[up_the_arm < up_the_arm.min() + 0.03]
        assert not in_frame(scene.camera, end_m).any()
        # The forearm's cut lies inside the cloth, so it shows from nowhere.
        skin_m = (geometry.vertices_m - scene.hand_to_world[:3, 3]) @ scene.hand_to_world[:3, 1]
        assert up_the_arm.min() < skin_m.min() - 0.4
        away_m = np.linalg.norm(cloth_m - camera_position(scene.camera), axis=1)
        assert away_m.min() >= 0.08
        pixels = to_pixels(scene.camera.intrinsics, to_camera(scene.camera, geometry.keypoints_m))
        size_px = float(np.nanmax(np.ptp(pixels, axis=0)))
        sizes.append(size_px / min(spec.image.width, spec.image.height))
    assert min(sizes) < 0.3
    assert max(sizes) > 0.5
