"""How even plans are: at their end, and at every length.

    .venv/bin/python benchmarks/plan_evenness.py [--specs 300] [--sizes 40]

Prints, for equal shares of every default value at several sizes, the joint cells' smallest and
largest counts, the furthest that any pair of values is from its expectation, and the furthest that
any value is from its share in any number of first images, both in images; the same for a spec that
asks for something of every attribute; then the same of random sizes with equal shares, and of
random specs of six to nine attributes with lists and skewed maps of exact counts.
"""

import argparse
import itertools
import platform
from collections.abc import Sequence

import numpy as np

from hi5_common.domain.plan import ALGORITHM, Plan
from hi5_common.domain.planning.order import Order
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import DatasetSpec, parse_spec
from hi5_common.domain.vocabulary import ALWAYS_BALANCED, VALUES, Attribute

SIZES = (12, 24, 100, 144, 1000, 4224, 10_000, 25_344, 100_000, 538_643, 100_000_000)
EVERYTHING: dict[str, Sequence[str | int]] = {
    "age": ["18..30", "30..45", "45..60", "60..90"],
    "weight": ["0..0.33", "0.33..0.67", "0.67..1"],
    "muscle": ["0..0.5", "0.5..1"],
    "finger_length": [-1, 0, 1],
    "finger_thickness": [-1, 0, 1],
    "hand_scale": [-1, 0, 1],
    "ring": ["none", "band", "gem"],
    "wrist_wear": ["none", "bracelet", "watch"],
    "nail_polish": ["none", "clear", "red", "pink", "dark"],
    "sleeve": ["none", "shirt", "knit", "jacket"],
}
"""Something of every attribute that is off by default."""
FOLLOWED = 1_000_000
"""Images whose every beginning is looked at, at most."""


def main() -> None:
    """Run both measurements."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--specs", type=int, default=300)
    parser.add_argument("--sizes", type=int, default=40)
    asked = parser.parse_args()
    specs = asked.specs
    print(f"plan {ALGORITHM}, Python {platform.python_version()}, numpy {np.__version__}")
    print("      images  attributes  joint cells  furthest pair  furthest beginning")
    for count in SIZES:
        report_plan({"count": count, "seed": 1})
    for count in (1000, 10_000, 100_000):
        report_plan({"count": count, "seed": 1, "attributes": EVERYTHING})
    report_sizes(asked.sizes)
    plans = [Plan.of(random_spec(seed)) for seed in range(specs)]
    pairs = sorted(map(furthest_pair, plans))
    beginnings = sorted(furthest_beginning(plan.order, plan.count) for plan in plans)
    for words, found in (("pair", pairs), ("beginning", beginnings)):
        middle, ninth, worst = found[len(found) // 2], found[len(found) * 9 // 10], found[-1]
        print(f"{specs} random specs (seeds 0..{specs - 1}), furthest {words}: ", end="")
        print(f"median {middle:.2f}, nine in ten below {ninth:.2f}, worst {worst:.2f}")


def report_plan(document: dict[str, object]) -> None:
    """Print one line about the plan of a spec."""
    plan = Plan.of(parse_spec(document))
    low, high = plan.joint_extremes()
    beginning = (
        f"{furthest_beginning(plan.order, plan.count):18.2f}"
        if plan.count <= FOLLOWED
        else f"{'':18}"
    )
    print(
        f"{plan.count:12,}  {len(plan.crossed):10}  {low:5,}-{high:<5,}  "
        f"{furthest_pair(plan):13.2f}  {beginning}",
        flush=True,
    )


def report_sizes(sizes: int) -> None:
    """Print how many sizes between 3 and a million keep every pair within one image."""
    rng = factor_rng(0, 0, "benchmark/sizes")
    plans = [
        Plan.of(parse_spec({"count": int(10 ** rng.uniform(0.5, 6)), "seed": seed}))
        for seed in range(sizes)
    ]
    pairs = [furthest_pair(plan) for plan in plans]
    beyond = sum(pair > 1.0 + 1e-6 for pair in pairs)
    uneven = sum(high - low > 1 for low, high in (plan.joint_extremes() for plan in plans))
    print(
        f"{sizes} random sizes, equal shares: {beyond} with a pair over 1.00 images off, ", end=""
    )
    print(f"worst {max(pairs):.2f}; {uneven} with joint cells over one image apart")


def furthest_beginning(order: Order, count: int) -> float:
    """Return how far any value of any number of first images is from its share, in images."""
    rows, worst = order.rows(np.arange(count, dtype=np.int64)), 0.0
    places = np.arange(1, count + 1)
    for column in rows.T:
        for value in range(int(column.max()) + 1):
            is_value = column == value
            off = np.cumsum(is_value) - places * is_value.mean()
            worst = max(worst, float(np.abs(off).max()))
    return worst


def furthest_pair(plan: Plan) -> float:
    """Return the largest distance of a pair's count from its expectation, in images."""
    worst = 0.0
    for a, b in itertools.combinations(plan.crossed, 2):
        of_a, of_b = plan.value_counts(a), plan.value_counts(b)
        for (x, y), images in plan.pair_counts(a, b).items():
            worst = max(worst, abs(images - of_a[x] * of_b[y] / plan.count))
    return worst


def random_spec(seed: int) -> DatasetSpec:
    """Draw a spec of 1 to 1,500 images; each attribute whole, a list, or a map of counts.

    The first six attributes always, and up to three of those that are off by default.
    """
    rng = factor_rng(seed, 0, "benchmark/spec")
    count = int(rng.integers(1, 1501))
    off = [attribute for attribute in Attribute if attribute not in ALWAYS_BALANCED]
    more = [off[number] for number in rng.permutation(len(off))[: seed % 4]]
    asked = (*ALWAYS_BALANCED, *more)
    requests = {attribute.value: _random_request(rng, attribute, count) for attribute in asked}
    return parse_spec({"count": count, "seed": seed, "attributes": requests})


def _random_request(rng: np.random.Generator, attribute: Attribute, count: int) -> object:
    known = EVERYTHING.get(attribute.value, VALUES[attribute])
    chosen = rng.permutation(len(known))[: int(rng.integers(1, len(known) + 1))]
    values = [known[number] for number in chosen]
    kind = ("all", "list", "map")[int(rng.integers(3))]
    if kind == "map":
        cuts = sorted(rng.integers(0, count + 1, len(values) - 1).tolist())
        bounds = itertools.pairwise([0, *cuts, count])
        return {value: stop - start for value, (start, stop) in zip(values, bounds, strict=True)}
    return values if kind == "list" else None


if __name__ == "__main__":
    main()
