"""Masks in COCO's compressed run-length encoding.

Counts of zeros and ones in turn, column by column, the first of zeros; from the fourth on each
count is written as its difference to the one two before; each number in groups of 5 bits, low
first, a sixth bit for "more", plus 48 to make it a printable character (COCO API, maskApi.c).
"""

import numpy as np
import numpy.typing as npt

from hi5_common.domain.labels import Mask

GROUPS = 7
"""5-bit groups that hold any signed difference of 32-bit counts."""


def encode_mask(mask: npt.NDArray[np.bool_]) -> Mask:
    """Return the COCO encoding of an (H, W) mask; size is (H, W) as COCO has it."""
    height, width = mask.shape
    counts = _characters(_differences(run_lengths(mask)))
    return Mask(size=(height, width), counts=counts, area_px=int(mask.sum()))


def run_lengths(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """Return the lengths of runs in column-major order; the first, maybe empty, is of zeros."""
    flat = np.concatenate([[False], mask.ravel(order="F")])
    changes = np.flatnonzero(flat[1:] != flat[:-1])
    return np.diff(np.concatenate([[0], changes, [mask.size]])).astype(np.int64)


def _differences(counts: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    numbers = counts.copy()
    numbers[3:] -= counts[1:-2]
    return numbers


def _characters(numbers: npt.NDArray[np.int64]) -> str:
    shifts = 5 * np.arange(GROUPS)
    groups = (numbers[:, None] >> shifts) & 0x1F
    # A number is complete once what is left is only copies of the last group's sign bit.
    rest = numbers[:, None] >> (shifts + 5)
    complete = np.where(groups & 0x10, rest == -1, rest == 0)
    last = complete.argmax(axis=1)
    position = np.arange(GROUPS)
    letters = groups + np.where(position < last[:, None], 0x20, 0) + 48
    written = letters[position <= last[:, None]].astype(np.uint8)
    return bytes(written).decode("ascii")
