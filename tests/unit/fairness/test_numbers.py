"""The audit's arithmetic, against the field's own implementations and against brute force."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pycocotools import mask as coco_mask
from scipy.stats import chi2_contingency
from scipy.stats.contingency import association as scipy_association

from hi5_common.domain.labels import Mask
from hi5_common.fairness.alike import NEAR, alike, near_pairs
from hi5_common.fairness.association import Column, association
from hi5_common.fairness.masks import decode_mask
from hi5_common.fairness.observed import bin_names, binned


@given(
    height=st.integers(1, 40), width=st.integers(1, 40), seed=st.integers(0, 2**32 - 1),
    block=st.integers(1, 30),
)  # fmt: skip
def test_a_mask_is_read_as_coco_writes_it(height: int, width: int, seed: int, block: int) -> None:
    rng = np.random.default_rng(seed)
    small = rng.random((-(-height // block), -(-width // block))) < 0.5
    pixels = np.kron(small, np.ones((block, block), bool))[:height, :width]
    encoded = coco_mask.encode(np.asfortranarray(pixels, np.uint8))
    mask = Mask(size=pixels.shape, counts=encoded["counts"].decode(), area_px=int(pixels.sum()))
    np.testing.assert_array_equal(decode_mask(mask), pixels)


@pytest.mark.parametrize("counts", ["o", "54", "0P"])
def test_runs_that_do_not_fill_a_mask_are_refused(counts: str) -> None:
    with pytest.raises(ValueError, match=r"pixels for a mask|does not end"):
        decode_mask(Mask(size=(4, 4), counts=counts, area_px=1))


def columns(table: np.ndarray) -> tuple[Column, Column]:
    """Two columns whose contingency table this is."""
    rows, places = np.nonzero(table >= 0)
    times = table[rows, places]
    names = tuple(f"v{number}" for number in range(max(table.shape)))
    return (
        Column("a", np.repeat(rows, times), names),
        Column("b", np.repeat(places, times), names),
    )


@pytest.mark.parametrize("seed", range(5))
def test_chi_square_and_v_are_scipys(seed: int) -> None:
    table = np.random.default_rng(seed).integers(8, 40, (3, 5))
    found = association(*columns(table))
    assert found is not None
    told = chi2_contingency(table, correction=False)
    assert found.chi2 == pytest.approx(told.statistic)
    assert found.p == pytest.approx(told.pvalue)
    assert (found.p_by, found.degrees_of_freedom) == ("chi2", told.dof)
    assert found.cramers_v == pytest.approx(scipy_association(table, method="cramer"))


def test_one_column_that_settles_the_other_has_v_one_and_names_the_cell() -> None:
    found = association(*columns(np.diag([30, 30, 90])))
    assert found is not None
    assert found.cramers_v == pytest.approx(1.0)
    assert found.corrected_v == pytest.approx(1.0, abs=0.01)
    assert found.p < 1e-12
    assert found.largest == ("v0", "v0")
    assert found.largest_images == 30
    assert found.largest_expected == pytest.approx(6.0)


def test_of_few_images_chance_is_dealt_and_taken_away() -> None:
    rng = np.random.default_rng(3)
    p, corrected, plain = [], [], []
    for _ in range(20):
        a = Column("a", rng.integers(0, 20, 150), tuple(map(str, range(20))))
        b = Column("b", rng.integers(0, 10, 150), tuple(map(str, range(10))))
        found = association(a, b)
        assert found is not None
        assert found.p_by == "dealing"
        p.append(found.p)
        corrected.append(found.corrected_v)
        plain.append(found.cramers_v)
    assert 0.25 < np.mean(p) < 0.75  # independent columns: uniform
    assert np.mean(plain) > 0.3  # what chance alone gives
    assert np.mean(corrected) < 0.1


def test_unknown_images_and_columns_without_choice_are_left_out() -> None:
    known = Column("a", np.array([0, 1, 0, 1, -1, -1]), ("x", "y"))
    settled = Column("b", np.array([0, 1, 0, 1, 0, 1]), ("x", "y"))
    found = association(known, settled)
    assert found is not None
    assert found.images == 4
    assert association(known, Column("c", np.zeros(6, np.int64), ("only",))) is None


@given(st.lists(st.integers(0, 2**64 - 1), max_size=30), st.integers(0, 2**32 - 1))
def test_near_hashes_are_found_as_by_comparing_all(hashes: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    for origin in hashes[:5]:  # some are near others, at and beyond the bound
        bits = rng.choice(64, rng.integers(0, NEAR + 3), replace=False)
        hashes.append(origin ^ sum(1 << int(bit) for bit in bits))
    expected = {
        (a, b): (hashes[a] ^ hashes[b]).bit_count()
        for a, b in combinations(range(len(hashes)), 2)
        if (hashes[a] ^ hashes[b]).bit_count() <= NEAR
    }
    assert near_pairs(np.array(hashes, np.uint64)) == expected


def test_same_bytes_are_named_by_the_first_that_has_them() -> None:
    found = alike([10, 11, 12, 13], [1, 2**40 - 1, 1, 2**63], [b"x", b"y", b"x", b"x"], [None] * 4)
    assert (found.identical, found.identical_pairs) == (2, ((10, 12), (10, 13)))
    assert [(pair.first, pair.second, pair.bits) for pair in found.near_pairs] == [
        (10, 12, 0),
        (10, 13, 2),
        (12, 13, 2),
    ]


def test_twins_are_left_out_and_counted_apart() -> None:
    digests = [b"x", b"x", b"z", b"x", b"w"]
    found = alike(range(10, 15), [1, 1, 3, 1, 2**40 - 1], digests, [0, 0, 0, 1, 1])
    assert found.twins == 3  # 10, 11 and 12 with each other
    assert (found.identical, found.identical_pairs) == (1, ((10, 13),))
    assert [(pair.first, pair.second) for pair in found.near_pairs] == [
        (10, 13),
        (11, 13),
        (12, 13),
    ]


def test_bins_hold_equal_numbers_and_leave_out_what_is_not_known() -> None:
    codes, edges = binned(np.array([5.0, np.nan, 1.0, 2.0, 3.0, 4.0]), 5)
    assert codes.tolist() == [4, -1, 0, 1, 2, 3]
    assert bin_names(edges)[0] == "1..1.8"
    codes, edges = binned(np.array([0.0, 0.0, 0.0, 0.0, 1.0]), 5)
    assert codes.tolist() == [0, 0, 0, 0, 0] or codes.max() == 1
    assert len(bin_names(edges)) == codes.max() + 1
    codes, edges = binned(np.full(3, 2.0), 5)
    assert (codes.tolist(), bin_names(edges)) == ([0, 0, 0], ("2",))
