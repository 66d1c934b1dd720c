"""How many images each value shall have, read from a request without the code that plans it."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from hi5_common.domain.values import in_order
from hi5_common.domain.vocabulary import DEFAULTS, Attribute


@dataclass(frozen=True)
class Weights:
    """Shares of the images, in any unit."""

    of: Mapping[str, float]


Request = list[str] | dict[str, int] | Weights | None
Wanted = dict[str, tuple[int, int]]
"""The fewest and the most images of every value, in canonical order."""


def wanted(attribute: Attribute, request: Request, count: int) -> Wanted:
    """Return what a request lets every value have."""
    if isinstance(request, Weights):
        request = _whole(request.of, attribute, count)
    if isinstance(request, dict):
        return {value: (request[value], request[value]) for value in in_order(attribute, request)}
    values = in_order(attribute, request or DEFAULTS[attribute])
    return dict.fromkeys(values, (count // len(values), -(-count // len(values))))


def middling(found: Wanted, count: int) -> list[int]:
    """Return counts that add up: the most for the first values, the fewest for the others."""
    over = count - sum(low for low, _ in found.values())
    counts = []
    for low, high in found.values():
        more = min(over, high - low)
        counts.append(low + more)
        over -= more
    return counts


def _whole(weights: Mapping[str, float], attribute: Attribute, count: int) -> dict[str, int]:
    """Return shares rounded down, and one more image for the largest remainders."""
    total = sum(Fraction(weight) for weight in weights.values())
    shares = {v: Fraction(weights[v]) * count / total for v in in_order(attribute, weights)}
    counts = {value: share.numerator // share.denominator for value, share in shares.items()}
    missing = count - sum(counts.values())
    by_remainder = sorted(shares, key=lambda value: shares[value] - counts[value], reverse=True)
    return {value: n + (value in by_remainder[:missing]) for value, n in counts.items()}
