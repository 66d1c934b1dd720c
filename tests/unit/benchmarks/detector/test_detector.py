import math

import pytest

from benchmarks.detector.facing import distance, facing
from benchmarks.detector.protocol import is_judged
from benchmarks.detector.report import as_json, in_words, tone_gap
from benchmarks.detector.score import Finding, Judged, Share, by_group, score
from hi5_common.domain.labels import Box, ImageLabel
from hi5_common.domain.vocabulary import Attribute, KeypointVisibility
from tests.unit.export.factories import ATTRIBUTES, keypoint, label

BOX = Box(x_px=100.0, y_px=200.0, width_px=150.0, height_px=250.0)


def _label(**changes: object) -> ImageLabel:
    points = tuple(
        keypoint(number, KeypointVisibility.VISIBLE).model_copy(
            update={"image_px": (150.0 + number, 250.0 + 2 * number)}
        )
        for number in range(21)
    )
    large = label().model_copy(update={"width_px": 640, "height_px": 640, "hand_box": BOX})
    whole = large.model_copy(update={"keypoints": points, "in_frame_share": 1.0})
    return whole.model_copy(update=changes)


def _found(image: ImageLabel, away_px: float = 0.0, side: str = "left") -> Judged:
    points = [point.image_px or (0.0, 0.0) for point in image.keypoints or ()]
    return Judged(image, Finding(tuple((x + away_px, y) for x, y in points), side))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, True),
        ({"in_frame_share": 0.999}, False),
        ({"hand_box": Box(x_px=1, y_px=1, width_px=199.9, height_px=150)}, False),
        ({"hand_box": Box(x_px=1, y_px=1, width_px=20, height_px=200)}, True),
        ({"hand_box": None}, False),
        ({"width_px": 641}, False),
        ({"attributes": {**ATTRIBUTES, Attribute.ENVIRONMENT: "night"}}, False),
    ],
)
def test_the_protocol_is_read_from_the_label(changes: dict[str, object], expected: bool) -> None:
    assert is_judged(_label(**changes)) is expected


def test_errors_are_shares_of_the_longer_side() -> None:
    figures = score([_found(_label(), away_px=10.0)])
    assert figures.mean_error == pytest.approx(10.0 / 250.0)
    assert figures.pck == 1.0


def test_a_point_exactly_at_the_threshold_is_wrong() -> None:
    assert score([_found(_label(), away_px=49.9)]).pck == 1.0
    assert score([_found(_label(), away_px=50.0)]).pck == 0.0


def test_a_hand_reported_elsewhere_is_not_found() -> None:
    figures = score([_found(_label(), away_px=300.0), _found(_label()), Judged(_label(), None)])
    assert (figures.found.hits, figures.found.of, figures.elsewhere) == (1, 3, 1)
    assert figures.mean_error == 0.0


def test_sides_are_compared_among_the_found_only() -> None:
    images = [_found(_label()), _found(_label(), side="right"), Judged(_label(), None)]
    assert score(images).side == Share(1, 2)


def test_nothing_found_has_no_errors() -> None:
    figures = score([Judged(_label(), None)])
    assert figures.found.value == 0.0
    assert math.isnan(figures.pck)
    assert "nan" not in str(as_json([Judged(_label(), None)]))


def test_wilsons_interval() -> None:
    low, high = Share(82, 100).interval  # 0.7333 and 0.8830 by hand
    assert (low, high) == pytest.approx((0.7333, 0.8830), abs=1e-4)
    assert Share(0, 10).interval[0] == 0.0
    assert Share(10, 10).interval[1] == pytest.approx(1.0)


def test_tones_are_compared_best_with_worst() -> None:
    dark = _label(attributes={**ATTRIBUTES, Attribute.SKIN_TONE: "dark"})
    images = [_found(_label()), _found(_label()), _found(dark), Judged(dark, None)]
    assert tone_gap(images) == pytest.approx(0.5)
    groups = by_group(images, lambda label: label.attributes[Attribute.SKIN_TONE])
    assert {name: len(group) for name, group in groups.items()} == {"tan": 2, "dark": 2}
    assert "75.0% (3 of 4;" in in_words(images)


@pytest.mark.parametrize(
    ("turn_deg", "side", "expected"),
    [
        # Fingers up, forefinger on the picture's left: a left hand's palm, a right hand's back.
        (0.0, "left", "palm"),
        (0.0, "right", "back"),
        (180.0, "left", "back"),
        (180.0, "right", "palm"),
        (50.0, "left", "palm"),
        (70.0, "left", "edge"),
    ],
)
def test_facing_is_the_side_turned_to_the_camera(turn_deg: float, side: str, expected: str) -> None:
    turn = math.radians(turn_deg)
    places = {"wrist": (0.0, 0.09), "forefinger1": (-0.02, 0.0), "middle_finger1": (0.0, 0.0)}
    places |= {"ring_finger1": (0.01, 0.0), "pinky_finger1": (0.03, 0.01)}
    points = []
    for number in range(21):
        point = keypoint(number)
        across, down = places.get(point.name, (0.0, 0.0))
        where = (across * math.cos(turn), down, 0.5 + across * math.sin(turn))
        points.append(point.model_copy(update={"camera_m": where}))
    attributes = {**ATTRIBUTES, Attribute.HANDEDNESS: side}
    assert facing(_label(keypoints=tuple(points), attributes=attributes)) == expected


@pytest.mark.parametrize(
    ("away_m", "expected"),
    [(0.2, "under 0.25 m"), (0.3, "under 0.35 m"), (0.4, "under 0.5 m"), (0.5, "0.5 m or more")],
)
def test_distance_is_that_of_the_middle_of_the_hand(away_m: float, expected: str) -> None:
    away = {"camera_m": (0.0, 0.0, away_m)}
    points = tuple(keypoint(number).model_copy(update=away) for number in range(21))
    assert distance(_label(keypoints=points)) == expected
