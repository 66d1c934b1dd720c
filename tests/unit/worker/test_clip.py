import json
from pathlib import Path

import numpy as np
import pytest

from hi5_common.domain.errors import InvalidInput
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec_text
from hi5_common.settings import RendererName
from services.worker import clip
from services.worker.scene.geometry import build_geometry
from services.worker.scene.sampling import sample_scene
from services.worker.scene.types import Camera, Intrinsics
from services.worker.scene.view import in_frame
from services.worker.studio import open_studio

SPEC = """
count: 2
seed: 5
image: {width: 96, height: 96}
attributes: {pose: [%s], environment: [studio]}
"""


def spec_of(pose: str) -> DatasetSpec:
    return parse_spec_text(SPEC % pose)


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hands")


def test_a_motion_becomes_a_clip_with_times_phases_and_velocities(
    cache: Path, tmp_path: Path
) -> None:
    studio = open_studio(RendererName.FAKE, 1, cache)
    rows = clip.render_clip(studio, spec_of("relaxed_wave"), 0, 3, 12.0, tmp_path)
    assert len(list((tmp_path / "frames").iterdir())) == 3
    assert (tmp_path / "preview.mp4").stat().st_size > 0
    filed = [json.loads(line) for line in (tmp_path / "clip.jsonl").read_text().splitlines()]
    assert filed == json.loads(json.dumps(rows))
    assert [row["time_s"] for row in filed] == pytest.approx([0.0, 1 / 12, 2 / 12])
    assert len({row["phase"] for row in filed}) == 3
    assert len({json.dumps(row["label"]["camera"]) for row in filed}) == 1
    places = np.array([[p["world_m"] for p in row["label"]["keypoints"]] for row in filed])
    middle = (places[2] - places[0]) * 6.0
    np.testing.assert_allclose(filed[1]["keypoint_velocities_m_s"], middle, atol=1e-6)
    assert np.abs(middle).max() > 0.05


def test_a_still_pose_becomes_a_way_to_another(cache: Path) -> None:
    studio = open_studio(RendererName.FAKE, 1, cache)
    frames = clip.moments(spec_of("fist"), studio, 0, 5, 10.0)
    assert [moment.phase for moment in frames] == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert frames[0].scene.angles != frames[-1].scene.angles


def test_every_frame_shows_what_the_still_shows(cache: Path) -> None:
    studio = open_studio(RendererName.FAKE, 1, cache)
    spec = parse_spec_text((SPEC % "relaxed_wave").replace("seed: 5", "seed: 6"))
    frames = clip.moments(spec, studio, 1, 12, 16.0)
    still = sample_scene(spec, Plan.of(spec), 1, studio.hands)
    shown = in_frame(still.camera, build_geometry(still, studio.hands).keypoints_m)
    assert shown.sum() > 15
    for moment in frames:
        keypoints_m = build_geometry(moment.scene, studio.hands).keypoints_m
        assert in_frame(moment.scene.camera, keypoints_m)[shown].all()
    assert len({moment.scene.look.noise_seed for moment in frames}) == 12


def test_a_lens_is_widened_only_as_far_as_points_need() -> None:
    lens = Intrinsics(100.0, 120.0, 50.0, 60.0, 100, 100)
    camera = Camera(lens, np.eye(4))
    assert clip.widened(camera, np.array([[0.1, 0.2, 1.0]])) == lens
    wide = clip.widened(camera, np.array([[0.92, 0.0, 1.0], [-0.1, 0.0, 1.0]]))
    assert (wide.fx_px, wide.fy_px) == pytest.approx((50.0, 60.0))


def test_a_clip_of_no_frames_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="frames"):
        clip._refuse(spec_of("fist"), 0, 0, 10.0)
