"""Every value has one spelling, and one place in the order."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hi5_common.domain.bands import Band, number_text, parse_band
from hi5_common.domain.values import (
    UnknownValue,
    canonical_value,
    in_order,
    may_be,
    overlapping,
    spelled,
)
from hi5_common.domain.vocabulary import (
    DEFAULTS,
    ITA_RANGE_DEG,
    SHAPE_RANGES,
    SKIN_TONE_ITA_DEG,
    VALUES,
    Attribute,
    SkinTone,
    skin_tone_ita_deg,
)

ANGLES = st.floats(*ITA_RANGE_DEG)
SHAPES = st.sampled_from(list(SHAPE_RANGES))


@given(ANGLES)
def test_a_typology_angle_is_one_value_however_it_is_written(angle: float) -> None:
    value = canonical_value(Attribute.SKIN_TONE, angle)
    assert skin_tone_ita_deg(value) == angle
    for other in (value, f" {angle!r} ", f"{angle:.40e}", f"{angle:+.30f}"):
        if float(other) == angle:
            assert canonical_value(Attribute.SKIN_TONE, other) == value


@given(st.floats() | st.integers())
def test_no_number_outside_the_range_is_a_skin_tone(number: float) -> None:
    low, high = ITA_RANGE_DEG
    if low <= number <= high:
        assert canonical_value(Attribute.SKIN_TONE, number) == number_text(float(number))
    else:
        with pytest.raises(UnknownValue, match="-90 to 70"):
            canonical_value(Attribute.SKIN_TONE, number)


def test_zero_has_no_sign() -> None:
    assert canonical_value(Attribute.SKIN_TONE, -0.0) == "0"
    assert canonical_value(Attribute.WEIGHT, "-0..0.5") == "0..0.5"


@given(SHAPES, st.floats(0, 1), st.floats(0, 1))
def test_a_band_is_read_back_as_it_was_written(attribute: Attribute, a: float, b: float) -> None:
    whole = SHAPE_RANGES[attribute].band
    low, high = sorted((whole.at(a), whole.at(b)))
    value = canonical_value(attribute, f"{low!r} .. {high!r}")
    assert parse_band(value) == Band(low, high)
    assert canonical_value(attribute, value) == value
    assert (".." in value) == (low < high)


@given(st.text(max_size=20))
def test_any_text_is_a_value_or_has_a_remedy(text: str) -> None:
    for attribute in Attribute:
        try:
            value = canonical_value(attribute, text)
        except UnknownValue:
            assert spelled(attribute, text) == text
        else:
            assert canonical_value(attribute, value) == value == spelled(attribute, text)


@given(st.lists(ANGLES, unique=True), st.sets(st.sampled_from(list(SkinTone))))
def test_skin_tones_run_from_light_to_dark(angles: list[float], names: set[SkinTone]) -> None:
    values = [*map(number_text, angles), *names]
    ordered = in_order(Attribute.SKIN_TONE, values)
    found = [skin_tone_ita_deg(value) for value in ordered]
    assert found == sorted(found, reverse=True)
    assert sorted(ordered) == sorted(values)
    twice = {name for name in names if SKIN_TONE_ITA_DEG[name] in angles}
    assert len(overlapping(Attribute.SKIN_TONE, values)) == len(twice)


@given(st.lists(st.tuples(st.integers(18, 90), st.integers(18, 90)), max_size=6))
def test_bands_overlap_where_they_share_more_than_an_end(ends: list[tuple[int, int]]) -> None:
    bands = {Band(min(pair), max(pair)) for pair in ends}
    clash = any(
        min(a.high, b.high) > max(a.low, b.low)
        or (min(a.high, b.high) == max(a.low, b.low) and (a.low == a.high or b.low == b.high))
        for a in bands
        for b in bands
        if a != b
    )
    assert bool(overlapping(Attribute.AGE, [str(band) for band in bands])) == clash


@pytest.mark.parametrize("text", ["", "..", "1..", "..2", "1...2", "0x1f", "1_0", "nan", "1e999"])
def test_what_is_no_band(text: str) -> None:
    with pytest.raises(ValueError, match=r"number|backwards"):
        parse_band(text)


def test_numbers_are_for_attributes_that_have_them() -> None:
    assert may_be(Attribute.AGE, 35)
    assert not may_be(Attribute.AGE, True)
    assert not may_be(Attribute.POSE, 35)
    assert not may_be(Attribute.SKIN_TONE, None)


def test_named_values_are_canonical_and_defaults_are_values() -> None:
    for attribute, named in VALUES.items():
        assert [canonical_value(attribute, value) for value in named] == list(named)
        assert in_order(attribute, reversed(named)) == list(named)
        assert set(DEFAULTS[attribute]) <= set(named)


def test_the_average_hand_is_inside_the_human_range() -> None:
    for found in SHAPE_RANGES.values():
        assert found.low < found.average < found.high
        assert all(map(math.isfinite, (found.low, found.high)))
