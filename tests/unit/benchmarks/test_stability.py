"""The cases of benchmarks/stability that take no hand: they hold, and would say so if not."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmarks.stability.__main__ import Found, colours, counts, light, refused, rotations
from hi5_common.domain.seeding import factor_rng

RNG = factor_rng(9, 0, "stability")


@pytest.mark.parametrize("cases", [lambda: rotations(RNG), lambda: colours(RNG), counts])
def test_numbers_hold_at_the_ends_of_their_ranges(cases: Callable[[], Iterator[Found]]) -> None:
    found = list(cases())
    assert found
    assert [str(case) for case in found if not case.holds] == []


def test_light_holds(tmp_path: Path) -> None:
    found = {case.case: case for case in light(tmp_path)}
    assert [str(case) for case in found.values() if not case.holds] == []
    assert "It is black" in str(found["a panorama of zero radiance"].refusal)
    assert "not numbers" in str(found["a panorama of NaN radiance"].refusal)


def test_what_passes_its_bound_or_is_not_refused_is_told() -> None:
    assert not Found("case", 2.0, 1.0, "px").holds
    assert "BEYOND" in str(Found("case", 2.0, 1.0, "px"))
    assert not refused("nothing wrong", lambda: None).holds
