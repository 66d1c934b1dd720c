import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from hi5_common.domain.vocabulary import KEYPOINTS, Attribute
from hi5_common.export import contact_sheet
from hi5_common.export.contact_sheet import (
    FINGER_BGR,
    DrawingUnavailable,
    UnreadablePicture,
    draw_keypoints,
    write_contact_sheet,
)
from tests.unit.export import factories
from tests.unit.export.factories import BEHIND, HIDDEN

TIP = KEYPOINTS.index("pinky_finger4")


def grey(path: Path) -> Path:
    cv2.imwrite(str(path), np.full((48, 64, 3), 128, np.uint8))
    return path


def test_the_sheet_has_a_cell_for_each_image(tmp_path: Path) -> None:
    image = grey(tmp_path / "i.png")
    cells = [(image, factories.label(index)) for index in range(5)]
    write_contact_sheet(tmp_path / "sheet.png", cells, columns=3, cell_px=128)
    sheet = cv2.imread(str(tmp_path / "sheet.png"))
    assert sheet is not None
    cell = 96 + contact_sheet.CAPTION_PX + contact_sheet.GAP_PX
    assert sheet.shape == (2 * cell + 6, 3 * (128 + 6) + 6, 3)


def test_a_visible_point_is_filled_with_its_fingers_colour_at_its_place() -> None:
    picture = np.zeros((192, 256, 3), np.uint8)
    draw_keypoints(picture, factories.label())
    x_px, y_px = (4 * value for value in factories.keypoint(TIP).image_px or (0, 0))
    assert tuple(picture[int(y_px), int(x_px)]) == FINGER_BGR[4]


def test_a_hidden_point_is_hollow() -> None:
    hidden = factories.keypoints(*[HIDDEN] * 21)
    drawn = [np.zeros((192, 256, 3), np.uint8) for _ in range(2)]
    for picture, points in zip(drawn, (factories.keypoints(), hidden), strict=True):
        draw_keypoints(picture, factories.label(keypoints=points))
    assert not np.array_equal(drawn[0], drawn[1])
    assert (drawn[1] > 0).sum() < (drawn[0] > 0).sum()


def test_points_behind_the_camera_are_not_drawn() -> None:
    picture = np.zeros((192, 256, 3), np.uint8)
    draw_keypoints(picture, factories.label(keypoints=factories.keypoints(*[BEHIND] * 21)))
    assert not picture.any()


def test_the_caption_names_angles_and_ornaments() -> None:
    attributes = {**factories.ATTRIBUTES, Attribute.SKIN_TONE: "-40", Attribute.RING: "gem"}
    first, second = contact_sheet.caption_lines(factories.label(4, attributes=attributes))
    assert "ITA -40" in first
    assert second.endswith("ring gem")


def test_the_caption_names_tone_gender_hand_pose_and_viewpoint() -> None:
    first, second = contact_sheet.caption_lines(factories.label(4))
    assert first == "4  tan, female, left hand"
    assert second == "rocker, third person"


def test_a_broken_image_is_named(tmp_path: Path) -> None:
    (tmp_path / "broken.jpg").write_bytes(b"not a jpeg")
    cells = [(tmp_path / "broken.jpg", factories.label())]
    with pytest.raises(UnreadablePicture, match=r"broken\.jpg"):
        write_contact_sheet(tmp_path / "sheet.png", cells)


def test_without_opencv_the_error_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(DrawingUnavailable, match="worker extra"):
        write_contact_sheet(tmp_path / "sheet.png", [])
