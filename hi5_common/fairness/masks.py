"""Masks of labels as arrays: the inverse of COCO's compressed run lengths (maskApi.c)."""

import numpy as np
import numpy.typing as npt

from hi5_common.domain.labels import Mask


def decode_mask(mask: Mask) -> npt.NDArray[np.bool_]:
    """Return the (H, W) mask. Raises ValueError where the runs do not fill it."""
    height, width = mask.size
    counts = run_lengths(mask.counts)
    if counts.sum() != height * width or (counts < 0).any():
        raise ValueError(f"runs of {counts.sum()} pixels for a mask of {height} x {width}")
    ones = np.arange(len(counts)) % 2 == 1
    return np.repeat(ones, counts).reshape((height, width), order="F")


def run_lengths(text: str) -> npt.NDArray[np.int64]:
    """Return the lengths of runs, zeros first.

    Numbers are written in groups of 5 bits, low first, the sixth bit for "more"; from the fourth
    on they are differences to the number two before. Raises ValueError for a number without end.
    """
    groups = np.frombuffer(text.encode("ascii"), np.uint8).astype(np.int64) - 48
    if not len(groups):
        return np.zeros(0, np.int64)
    last = np.flatnonzero((groups & 0x20) == 0)
    if not len(last) or last[-1] != len(groups) - 1:
        raise ValueError("a run length does not end")
    first = np.concatenate([[0], last[:-1] + 1])
    place = np.arange(len(groups)) - np.repeat(first, last - first + 1)
    numbers = np.add.reduceat((groups & 0x1F) << (5 * place), first)
    negative = (groups[last] & 0x10) != 0
    numbers -= np.where(negative, 1 << (5 * (last - first + 1)), 0)
    counts = numbers.copy()
    counts[1::2] = np.cumsum(numbers[1::2])
    counts[2::2] = np.cumsum(numbers[2::2])
    return counts
