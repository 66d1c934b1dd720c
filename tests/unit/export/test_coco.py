import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pycocotools.coco import COCO

from hi5_common.domain.labels import ImageLabel
from hi5_common.domain.spec import parse_spec
from hi5_common.domain.vocabulary import Attribute
from hi5_common.export.coco import OccludedPoints, write_coco
from tests.unit.export import factories
from tests.unit.export.factories import BEHIND, HIDDEN, OUTSIDE

SPEC = parse_spec({"name": "hands", "count": 3, "seed": 5})
RIGHT = factories.ATTRIBUTES | {Attribute.HANDEDNESS: "right"}


def written(path: Path, *labels: ImageLabel, **options: Any) -> dict[str, Any]:
    write_coco(path / "coco.json", labels, SPEC, **options)
    document: dict[str, Any] = json.loads((path / "coco.json").read_text("utf-8"))
    return document


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
def test_pycocotools_loads_it_and_decodes_the_mask(tmp_path: Path) -> None:
    labels = [factories.label(index) for index in range(3)]
    assert write_coco(tmp_path / "coco.json", labels, SPEC) == 3
    coco = COCO(tmp_path / "coco.json")
    assert sorted(coco.getImgIds()) == [0, 1, 2]
    (annotation,) = coco.loadAnns(coco.getAnnIds(imgIds=2))
    mask = coco.annToMask(annotation)
    expected = np.zeros((48, 64), np.uint8)
    expected[1:5, 2:7] = 1
    assert np.array_equal(mask, expected)
    assert annotation["area"] == mask.sum()
    expected[1:5, 7] = 1
    with_forearm = annotation["hi5"]["segmentation_with_forearm"]
    assert np.array_equal(coco.annToMask(annotation | {"segmentation": with_forearm}), expected)


def test_points_out_of_sight_are_zero_and_hidden_ones_are_one(tmp_path: Path) -> None:
    points = factories.keypoints(BEHIND, OUTSIDE, HIDDEN)
    document = written(tmp_path, factories.label(keypoints=points))
    (annotation,) = document["annotations"]
    flat = annotation["keypoints"]
    assert flat[:6] == [0, 0, 0, 0, 0, 0]
    assert flat[6:9] == [10.0, 39.333, 1]
    assert flat[9:12] == [12.5, 39.0, 2]
    assert annotation["num_keypoints"] == 19
    assert annotation["hi5"]["keypoints_px"][:2] == [None, [107.5, 39.667]]
    assert annotation["hi5"]["visibility"][:3] == ["behind_camera", "out_of_frame", "self_occluded"]


def test_hidden_points_may_be_omitted(tmp_path: Path) -> None:
    one = factories.label(keypoints=factories.keypoints(HIDDEN))
    document = written(tmp_path, one, occluded=OccludedPoints.OMITTED)
    assert document["annotations"][0]["keypoints"][:3] == [0, 0, 0]
    assert document["annotations"][0]["num_keypoints"] == 20


def test_hands_are_told_apart_by_category_and_carry_their_attributes(tmp_path: Path) -> None:
    document = written(tmp_path, factories.label(0), factories.label(1, attributes=RIGHT))
    names = {category["id"]: category["name"] for category in document["categories"]}
    left, right = document["annotations"]
    assert names[left["category_id"]] == "left_hand"
    assert names[right["category_id"]] == "right_hand"
    assert left["attributes"]["skin_tone"] == "tan"
    assert left["attributes"]["ring"] == "none"
    assert left["hi5"]["affect"] == "Enthusiasm, rebelliousness (rock culture)"
    assert (left["id"], right["id"]) == (1, 2)


def test_the_skeleton_is_one_based_and_reaches_every_point(tmp_path: Path) -> None:
    category = written(tmp_path, factories.label())["categories"][0]
    assert category["keypoints"][0] == "wrist"
    assert len(category["keypoints"]) == 21
    assert category["skeleton"][:5] == [[1, 2], [2, 3], [3, 4], [4, 5], [1, 6]]
    assert {number for bone in category["skeleton"] for number in bone} == set(range(1, 22))


def test_labels_not_asked_for_are_left_out(tmp_path: Path) -> None:
    bare = factories.label(keypoints=None, box=None, hand_box=None, mask=None, hand_mask=None)
    (annotation,) = written(tmp_path, bare)["annotations"]
    assert not {"keypoints", "num_keypoints", "bbox", "segmentation", "area"} & set(annotation)


def test_without_masks_the_area_is_a_share_of_the_box(tmp_path: Path) -> None:
    boxed = factories.label(mask=None, hand_mask=None)
    (annotation,) = written(tmp_path, boxed)["annotations"]
    assert annotation["area"] == pytest.approx(0.53 * 5 * 4)
    assert "segmentation" not in annotation


def test_without_boxes_the_points_in_the_frame_make_one(tmp_path: Path) -> None:
    points = factories.keypoints(BEHIND, OUTSIDE, HIDDEN)
    only_points = factories.label(
        box=None, hand_box=None, mask=None, hand_mask=None, keypoints=points
    )
    (annotation,) = written(tmp_path, only_points)["annotations"]
    seen = [point.image_px for point in points[2:] if point.image_px]
    left, top, width, height = annotation["bbox"]
    assert left == pytest.approx(min(x for x, _ in seen), abs=0.001)
    assert top == pytest.approx(min(y for _, y in seen), abs=0.001)
    assert left + width == pytest.approx(max(x for x, _ in seen), abs=0.002)
    assert top + height == pytest.approx(max(y for _, y in seen), abs=0.002)
    assert annotation["area"] > 0


def test_the_box_is_the_hands_and_the_file_name_has_its_folder(tmp_path: Path) -> None:
    document = written(tmp_path, factories.label(7), image_dir_name="images")
    assert document["annotations"][0]["bbox"] == [2, 1, 5, 4]
    assert document["annotations"][0]["hi5"]["box_with_forearm"] == [2, 1, 6, 4]
    assert document["images"][0]["file_name"] == "images/000000007.jpg"


def test_equal_labels_give_equal_bytes_and_no_clock(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_coco(tmp_path / name, [factories.label()], SPEC)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    info = json.loads((tmp_path / "a").read_text())["info"]
    assert set(info) == {"description", "version", "contributor", "spec_sha256", "seed"}


def test_a_failed_export_leaves_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "coco.json"
    target.write_text("old")
    nameless = factories.label(attributes={})
    with pytest.raises(KeyError):
        write_coco(target, [nameless], SPEC)
    assert target.read_text() == "old"
