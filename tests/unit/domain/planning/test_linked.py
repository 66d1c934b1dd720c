"""The images of demanded combinations are whole numbers, the only best ones, found in silence."""

import json
from fractions import Fraction

import numpy as np
import pytest

from hi5_common.domain.plan import Plan
from hi5_common.domain.planning.linked import Linked
from hi5_common.domain.planning.strand import Strand
from hi5_common.domain.planning.terms import Conditional, Demand
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import parse_spec


def strand(*counts: int) -> Strand:
    return Strand(len(counts), np.array(counts, np.int64))


def some(count: int, **values: int) -> Demand:
    return Demand({int(place[1:]): frozenset({value}) for place, value in values.items()}, count)


def test_the_seed_decides_among_equally_good_answers_and_not_the_solver() -> None:
    """Two images of two values each twice: half an image of all four pairs is wanted."""
    any_values = Demand({0: frozenset({0, 1}), 1: frozenset({0, 1})}, 2)
    linked = Linked((Strand(2), Strand(2)), (any_values,), 2)
    found = set()
    for seed in range(20):
        images = linked.solved(factor_rng(seed, 0, "test"))
        assert images is not None
        found.add(tuple(images.tolist()))
    assert found == {(1, 0, 0, 1), (0, 1, 1, 0)}


def test_the_solver_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    """What a command prints for scripts is on the same stream as HiGHS's own notes."""
    spec = parse_spec(json.loads(NOTED))
    assert Plan.of(spec).count == 4
    assert capfd.readouterr() == ("", "")


NOTED = """{"count": 4, "seed": 468,
"attributes": {"skin_tone": ["tan"], "environment": ["night"], "viewpoint": ["first_person"],
 "pose": {"relaxed_wave": 0, "shakespeares_yorick": 1, "thumb_up_normal": 3},
 "handedness": {"left": 1, "right": 3}, "age": ["45..60", "30..45", "18..30", "60..90"],
 "nail_polish": {"none": 1, "clear": 2, "pink": 1}, "wrist_wear": {"bracelet": 1, "none": 3}},
"combinations": [
 {"of": {"age": ["45..60", "60..90"], "wrist_wear": ["bracelet"], "nail_polish": ["clear"]},
  "count": 0},
 {"of": {"wrist_wear": ["none"], "pose": ["shakespeares_yorick"], "age": ["30..45", "45..60"]},
  "count": 0},
 {"of": {"handedness": ["right"], "pose": ["thumb_up_normal"], "age": ["45..60", "18..30"]},
  "count": 0},
 {"of": {"nail_polish": ["pink"], "handedness": ["right"]}, "count": 0}]}"""


@pytest.mark.parametrize("count", [999_999_937, 1_000_000_000])
def test_a_thousand_million_images_are_counted_exactly(count: int) -> None:
    half = count // 2
    linked = Linked(
        (strand(half, count - half - 1, 1), Strand(7), Strand(2)),
        (some(123_456_789, p0=0, p1=3), some(0, p0=1, p2=0), some(1, p0=2, p1=6)),
        count,
    )
    images = linked.solved(factor_rng(1, 0, "test"))
    assert images is not None
    values = linked.combinations
    counts = [np.bincount(column, weights=images).astype(int) for column in values.T]
    assert counts[0].tolist() == [half, count - half - 1, 1]
    assert np.ptp(counts[1]) <= 1
    assert np.ptp(counts[2]) <= 1
    assert images[(values[:, 0] == 0) & (values[:, 1] == 3)].sum() == 123_456_789
    assert images[(values[:, 0] == 1) & (values[:, 2] == 0)].sum() == 0
    assert images[(values[:, 0] == 2) & (values[:, 1] == 6)].sum() == 1


def test_what_no_demand_tells_apart_is_solved_as_classes() -> None:
    """Thousands of combinations with a share each are too hard a program; of classes it is not."""
    shares = tuple(Fraction(1 + value % 5, 2 + 3 * 43) for value in range(43))
    shares = tuple(share / sum(shares) for share in shares)
    asked = Conditional({0: frozenset(range(60))}, 1, shares)
    linked = Linked((Strand(110), Strand(43)), (asked,), 9999, frozenset({1}))
    assert linked.clash() == ()
    images = linked.solved(factor_rng(1, 0, "test"))
    assert images is not None
    values = linked.combinations
    assert np.ptp(np.bincount(values[:, 0], weights=images)) <= 1
    within = images * (values[:, 0] < 60)
    counts = np.bincount(values[:, 1], weights=within)
    whole = counts.sum()
    assert all(abs(n - float(share) * whole) < 1 for n, share in zip(counts, shares, strict=True))
    mine = images[values[:, 0] == 7]
    assert np.abs(mine - whole / 60 * np.array(shares, float)).max() <= 1
