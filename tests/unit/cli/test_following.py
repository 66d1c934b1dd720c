import pytest

from hi5_common.cli.following import Pace


def test_pace_counts_from_the_first_change() -> None:
    pace = Pace(0.0)
    for now_s, images in ((0, 0), (10, 0), (12, 4), (15, 10)):
        pace.observe(float(now_s), images)
    assert pace.images_per_s == pytest.approx(2.0)
    assert pace.words(100) == "2.00 images/s, 0:45 left"


def test_pace_says_nothing_before_it_knows() -> None:
    pace = Pace(0.0)
    pace.observe(5.0, 0)
    assert pace.words(10) == ""


def test_pace_starts_again_when_images_are_taken_back() -> None:
    pace = Pace(0.0)
    for now_s, images in ((0, 10), (5, 20), (6, 0), (10, 8)):
        pace.observe(float(now_s), images)
    assert pace.images_per_s == pytest.approx(2.0)


def test_long_times_have_hours() -> None:
    pace = Pace(0.0)
    pace.observe(0.0, 0)
    pace.observe(1.0, 1)
    assert pace.words(7262).endswith("2:01:01 left")
