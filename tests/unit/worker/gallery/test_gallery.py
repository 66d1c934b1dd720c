"""The gallery shows what it says, from fixed views, and its sheets hold every picture."""

from dataclasses import replace

import numpy as np
import pytest

from hi5_common.domain.spec import Quality, parse_spec
from hi5_common.domain.vocabulary import Attribute, Gender, Pose, SkinTone
from services.worker.gallery.photograph import Photographer
from services.worker.gallery.scenes import DEFAULT_ATTRIBUTES, Aim, Sitting, scene_of
from services.worker.gallery.sections import PLACES, SECTIONS
from services.worker.gallery.sheet import laid_out
from services.worker.label.projection import in_frame, to_camera, to_pixels
from services.worker.render.fake import FakeRenderer
from services.worker.scene.geometry import build_geometry
from services.worker.scene.library import HandLibrary

PLAIN = {Attribute.ENVIRONMENT: "studio"}
"""A place that need not be baked."""


@pytest.fixture(scope="module")
def hands(tmp_path_factory: pytest.TempPathFactory) -> HandLibrary:
    return HandLibrary(tmp_path_factory.mktemp("hands"))


def test_the_sheets_show_what_they_promise() -> None:
    sections = {name: make() for name, make in SECTIONS.items()}
    for name, section in sections.items():
        assert section.name == name
        titles = [sitting.title for sitting in section.sittings]
        assert len(set(titles)) == len(titles) or name == "ornaments"
        assert len({sitting.side_px for sitting in section.sittings}) == 1
        for sitting in section.sittings:
            asked = {**DEFAULT_ATTRIBUTES, **sitting.attributes}
            parse_spec({"count": 1, "attributes": {k.value: [str(v)] for k, v in asked.items()}})
    for gender in Gender:
        poses = sections[f"poses_{gender.value}"].sittings
        assert [sitting.attributes[Attribute.POSE] for sitting in poses] == list(Pose)
    tones = [
        (sitting.attributes[Attribute.GENDER], sitting.attributes[Attribute.SKIN_TONE])
        for sitting in sections["tones"].sittings
    ]
    assert sorted(tones) == sorted(2 * [(g.value, t.value) for g in Gender for t in SkinTone])
    assert len(PLACES) == len(set(PLACES)) == 12


@pytest.mark.parametrize("turn_deg", [12.0, 90.0, 168.0])
@pytest.mark.parametrize("side", ["right", "left"])
def test_a_sitting_is_upright_whole_and_seen_from_the_side_asked_for(
    hands: HandLibrary, turn_deg: float, side: str
) -> None:
    asked = {**PLAIN, Attribute.POSE: Pose.FIVE, Attribute.HANDEDNESS: side}
    sitting = Sitting("", asked, Aim(turn_deg), side_px=96)
    scene = scene_of(sitting, hands)
    geometry = build_geometry(scene, hands)
    camera_m = to_camera(scene.camera, geometry.keypoints_m)
    pixels = to_pixels(scene.camera.intrinsics, camera_m)
    assert in_frame(scene.camera.intrinsics, pixels).all()
    assert pixels[12, 1] < pixels[0, 1] - 30, "fingers point up"
    depth = camera_m[:, 2]
    if turn_deg == 90.0:
        assert depth[4] < depth[17] - 0.03, "the thumb is nearest"
    else:
        # From the back of a right hand the thumb is to the left, as from the palm of a left one.
        thumb_is_left = (turn_deg < 90.0) == (side == "right")
        assert (pixels[4, 0] < pixels[20, 0]) == thumb_is_left
    assert scene.angles == scene_of(replace(sitting, seed=2), hands).angles


def test_a_photograph_has_the_hand_on_plain_ground(hands: HandLibrary) -> None:
    photographer = Photographer(FakeRenderer(), hands, Quality.DRAFT)
    picture = photographer.take(Sitting("", PLAIN, Aim(12.0), side_px=96))
    assert picture.shape == (96, 96, 3)
    assert (picture[0, 0] == picture[0, -1]).all()
    assert (picture != picture[0, 0]).any(axis=-1).mean() > 0.1


def test_a_sheet_holds_every_picture_in_its_place() -> None:
    pictures = [np.full((20, 30, 3), 13 * number, dtype=np.uint8) for number in range(5)]
    sheet = laid_out("", [("", picture) for picture in pictures], 2)
    corners = [(sheet == 13 * number).all(axis=-1).nonzero() for number in range(1, 5)]
    assert [len(rows) for rows, _ in corners] == [600] * 4
    tops = [int(rows.min()) for rows, _ in corners]
    lefts = [int(columns.min()) for _, columns in corners]
    assert lefts[1] < lefts[0] == lefts[2] > lefts[3]
    assert tops[0] < tops[1] == tops[2] < tops[3]
