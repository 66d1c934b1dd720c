"""One image, three ways to it: a studio in this process, the render child, local rendering."""

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pycocotools import mask as coco_mask

from hi5_common.domain.faults import ImageFault
from hi5_common.domain.labels import Box, ImageLabel, Mask
from hi5_common.domain.plan import Plan
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import KeypointVisibility
from hi5_common.export.label_table import read_label_table
from services.worker.outcome import fault_of
from services.worker.render.errors import RenderFailed
from services.worker.render.fake import FakeRenderer
from services.worker.render.port import Frame
from services.worker.render.rect import PixelRect
from services.worker.render.settings import RenderSettings
from services.worker.sample import Studio
from services.worker.scene.library import HandLibrary
from services.worker.scene.types import HandScene, SceneGeometry

pytestmark = pytest.mark.render

SMALL: dict[str, Any] = {
    "count": 6,
    "seed": 11,
    "image": {"width": 96, "height": 64},
    "render": {"quality": "draft"},
}


def _child(tmp_path: Path, cache: Path, renderer: str, indices: list[int]) -> list[dict[str, Any]]:
    job = {
        "spec": SMALL,
        "indices": indices,
        "out_dir": str(tmp_path / "child"),
        "threads": 1,
        "renderer": renderer,
        "cache_dir": str(cache),
        "fault": None,
    }
    reader, writer = os.pipe()
    command = [sys.executable, "-c", f"import os; os.dup2({writer}, 3); {_RUN}"]
    try:
        subprocess.run(
            command,
            input=json.dumps(job) + "\n",
            text=True,
            pass_fds=[writer],
            check=True,
            capture_output=True,
        )
    finally:
        os.close(writer)
    with os.fdopen(reader, encoding="utf-8") as events:
        return [json.loads(line) for line in events]


_RUN = "import runpy; runpy.run_module('services.worker.render_child', run_name='__main__')"


def _local(
    tmp_path: Path, cache: Path, renderer: str, *options: str
) -> "subprocess.CompletedProcess[str]":
    spec = tmp_path / "spec.yaml"
    spec.write_text(json.dumps(SMALL), encoding="utf-8")
    command = [sys.executable, "-m", "services.worker.local_render", str(spec)]
    command += ["--out", str(tmp_path / "local"), "--renderer", renderer, *options]
    environment = {**os.environ, "HI5_CACHE_DIR": str(cache)}
    return subprocess.run(command, env=environment, text=True, capture_output=True, check=False)


@pytest.mark.parametrize("renderer", ["cycles", "fake"])
def test_the_fleets_image_and_the_local_one_are_the_same_bytes(
    tmp_path: Path, hands_cache: Path, renderer: str
) -> None:
    ready, image, other, done = _child(tmp_path, hands_cache, renderer, [4, 1])
    assert (ready["event"], image["event"], other["event"], done["event"]) == (
        *("ready", "image", "image"),
        "done",
    )
    assert (image["index"], other["index"], done["images"]) == (4, 1, 2)
    answer = _local(tmp_path, hands_cache, renderer, "--index", "1", "--json")
    assert answer.returncode == 0, answer.stderr
    assert json.loads(answer.stdout)["images"] == 1
    theirs = tmp_path / "child" / "000000001.jpg"
    ours = tmp_path / "local" / "images" / "000000001.jpg"
    assert ours.read_bytes() == theirs.read_bytes()
    assert hashlib.sha256(theirs.read_bytes()).hexdigest() == other["image_sha256"]
    label_file = (tmp_path / "child" / "000000001.json").read_bytes()
    assert hashlib.sha256(label_file).hexdigest() == other["label_sha256"]
    (label,) = read_label_table(tmp_path / "local" / "labels.parquet")
    assert label.model_dump_json().encode() == label_file
    assert label.scene["renderer"] == renderer
    coco = json.loads((tmp_path / "local" / "coco.json").read_text(encoding="utf-8"))
    assert [entry["file_name"] for entry in coco["images"]] == ["images/000000001.jpg"]
    assert sorted(path.name for path in (tmp_path / "child").iterdir()) == [
        *("000000001.jpg", "000000001.json"),
        *("000000004.jpg", "000000004.json"),
    ]


def test_an_index_outside_the_dataset_is_told(tmp_path: Path, hands_cache: Path) -> None:
    answer = _local(tmp_path, hands_cache, "fake", "--index", "6")
    assert answer.returncode == 2
    assert "index: 6 is not valid. Name an image from 0 to 5" in answer.stderr
    assert not answer.stdout


def test_a_failed_image_does_not_stop_the_child(tmp_path: Path, hands_cache: Path) -> None:
    _, failed, image, done = _child(tmp_path, hands_cache, "fake", [99, 0])
    assert (failed["event"], failed["index"], failed["fault"]) == ("failed", 99, "bug")
    assert (image["event"], done["images"]) == ("image", 1)


def _label(hands: HandLibrary, **changes: Any) -> ImageLabel:
    spec: DatasetSpec = parse_spec({**SMALL, **changes})
    return Studio(FakeRenderer(), hands).make_sample(spec, Plan.of(spec), 0).label


def test_labels_that_are_not_asked_for_are_none(hands: HandLibrary) -> None:
    keypoints = _label(hands, labels=["keypoints"])
    assert (keypoints.box, keypoints.hand_box, keypoints.mask, keypoints.hand_mask) == (None,) * 4
    box = _label(hands, labels=["box"])
    assert (box.keypoints, box.mask) == (None, None)
    whole = _label(hands)
    assert whole.keypoints == keypoints.keypoints
    assert whole.box == box.box


@dataclass(frozen=True)
class Spoilt(FakeRenderer):
    """Draws as the fake does, and then gives every pixel's light or cover another value."""

    channels: slice
    value: float

    def render(
        self,
        scene: HandScene,
        geometry: SceneGeometry,
        region: PixelRect,
        settings: RenderSettings,
    ) -> Frame:
        frame = super().render(scene, geometry, region, settings)
        frame.rgba[..., self.channels] = self.value
        return frame


@pytest.mark.parametrize(
    ("channels", "value", "fault"),
    [
        (slice(0, 3), 0.0, ImageFault.BLACK_FRAME),
        (slice(0, 1), np.nan, ImageFault.NON_FINITE_FRAME),
        (slice(0, 3), np.inf, ImageFault.NON_FINITE_FRAME),
        (slice(3, 4), 0.0, ImageFault.EMPTY_FRAME),
    ],
)
def test_no_image_is_made_of_a_frame_that_is_not_worth_keeping(
    hands: HandLibrary, channels: slice, value: float, fault: ImageFault
) -> None:
    spec = parse_spec(SMALL)
    with pytest.raises(RenderFailed) as caught:
        Studio(Spoilt(channels, value), hands).make_sample(spec, Plan.of(spec), 0)
    assert fault_of(caught.value) is fault


def rle(mask: Mask) -> dict[str, Any]:
    return {"size": list(mask.size), "counts": mask.counts}


def assert_inside(mask: npt.NDArray[np.uint8], box: Box) -> None:
    rows, columns = np.nonzero(mask)
    assert box.x_px <= columns.min() + 0.5
    assert columns.max() + 0.5 <= box.x_px + box.width_px
    assert box.y_px <= rows.min() + 0.5
    assert rows.max() + 0.5 <= box.y_px + box.height_px


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
def test_a_label_holds_together(hands: HandLibrary) -> None:
    spec = parse_spec({**SMALL, "image": {"width": 160, "height": 120}})
    studio, plan = Studio(FakeRenderer(), hands), Plan.of(spec)
    for index in range(spec.count):
        label = studio.make_sample(spec, plan, index).label
        assert label.keypoints
        assert label.box
        assert label.hand_box
        assert label.mask
        assert label.hand_mask
        mask, hand = (coco_mask.decode(rle(part)) for part in (label.mask, label.hand_mask))
        assert (int(mask.sum()), int(hand.sum())) == (label.mask.area_px, label.hand_mask.area_px)
        assert 0 < hand.sum() <= mask.sum()
        assert not (hand & ~mask & 1).any()
        assert_inside(hand, label.hand_box)
        assert_inside(mask, label.box)
        assert 0.75 <= label.in_frame_share <= 1.0
        assert label.hand_box.x_px >= label.box.x_px
        assert label.hand_box.y_px >= label.box.y_px
        for point in label.keypoints:
            if point.visibility is KeypointVisibility.VISIBLE:
                assert point.image_px
                assert 0 <= point.image_px[0] - label.box.x_px <= label.box.width_px
                assert 0 <= point.image_px[1] - label.box.y_px <= label.box.height_px
            hidden = point.visibility is KeypointVisibility.SELF_OCCLUDED
            assert (point.occluder is not None) == hidden
        assert ImageLabel.model_validate_json(label.model_dump_json()) == label
