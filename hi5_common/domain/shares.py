"""Whole numbers out of weights."""

from collections.abc import Mapping
from fractions import Fraction


def whole_shares(weights: Mapping[str, float], count: int) -> dict[str, int]:
    """Return whole numbers that add up to `count`, as near to the weights' shares as can be.

    Each is its share's floor or ceiling; the largest fractions are rounded up, the first of equal
    ones before the others. Exact arithmetic: the same on every machine.
    """
    total = sum(map(Fraction, weights.values()))
    exact = {value: Fraction(weight) * count / total for value, weight in weights.items()}
    whole = {value: int(share) for value, share in exact.items()}
    over = count - sum(whole.values())
    for value in sorted(exact, key=lambda value: whole[value] - exact[value])[:over]:
        whole[value] += 1
    return whole
