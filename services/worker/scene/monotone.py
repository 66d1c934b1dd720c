"""A monotone cubic through a few points (Fritsch and Carlson 1980; slopes of Fritsch and Butland).

The same curve as scipy's PchipInterpolator, which costs each process that renders a second to
import.
"""

import bisect
from collections.abc import Sequence


def monotone_cubic(at: float, xs: Sequence[float], ys: Sequence[float]) -> float:
    """Return the value at `at` of the curve through (xs, ys); xs rise, at least three.

    No value lies beyond those of its two neighbours. ValueError outside of xs, or for NaN.
    """
    if not xs[0] <= at <= xs[-1]:
        raise ValueError(f"{at} lies outside {xs[0]} to {xs[-1]}.")
    row = min(bisect.bisect_right(xs, at), len(xs) - 1) - 1
    width = xs[row + 1] - xs[row]
    t = (at - xs[row]) / width
    start, end = _slope(row, xs, ys), _slope(row + 1, xs, ys)
    rise = ys[row + 1] - ys[row]
    bend = width * (start + end) - 2.0 * rise
    turn = 3.0 * rise - width * (2.0 * start + end)
    return ys[row] + t * (width * start + t * (turn + t * bend))


def _slope(row: int, xs: Sequence[float], ys: Sequence[float]) -> float:
    """Return the curve's slope at a point: the weighted harmonic mean of those of the chords."""
    if row == 0:
        return _end_slope(*_chord(0, xs, ys), *_chord(1, xs, ys))
    if row == len(xs) - 1:
        return _end_slope(*_chord(row - 1, xs, ys), *_chord(row - 2, xs, ys))
    (before, left), (after, right) = _chord(row - 1, xs, ys), _chord(row, xs, ys)
    if left * right <= 0.0:
        return 0.0
    first, second = 2.0 * after + before, after + 2.0 * before
    return (first + second) / (first / left + second / right)


def _chord(row: int, xs: Sequence[float], ys: Sequence[float]) -> tuple[float, float]:
    """Return the width and the slope of the chord from one point to the next."""
    width = xs[row + 1] - xs[row]
    return width, (ys[row + 1] - ys[row]) / width


def _end_slope(width: float, chord: float, next_width: float, next_chord: float) -> float:
    """Return the slope of a parabola through three points, held back to stay monotone."""
    slope = ((2.0 * width + next_width) * chord - width * next_chord) / (width + next_width)
    if slope * chord <= 0.0:
        return 0.0
    if chord * next_chord <= 0.0 and abs(slope) > 3.0 * abs(chord):
        return 3.0 * chord
    return slope
