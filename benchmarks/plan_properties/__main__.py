"""Hold thousands of random specs against what hi5 promises of plans and refusals.

    python -m benchmarks.plan_properties [--specs 5000] [--seed 0] [--digests]

Draws a spec for each seed from `--seed` on, asks OR-Tools' CP-SAT whether it can be met, and
expects a plan just when it can. A plan must keep its promises, and come out the same when it is
made again, here and in another process; a refusal must name demands of which none can be left out,
and counts that are nearest. Prints what was found, and every fault with the seed that shows it
again; ends with 1 if there is one. With --digests prints a hash of each plan instead.
"""

import argparse
import platform
import sys
import time
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version

from benchmarks.plan_properties.run import Outcome, digests, digests_elsewhere, examined
from hi5_common.domain.plan import ALGORITHM


def main() -> int:
    """Run, and return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--specs", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--digests", action="store_true")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.specs)
    if asked.digests:
        for seed, hashed in digests(seeds).items():
            print(seed, hashed)
        return 0
    print(f"plan {ALGORITHM}, Python {platform.python_version()}, OR-Tools {version('ortools')}")
    began = time.process_time()
    outcomes = [examined(seed) for seed in seeds]
    spent_s = time.process_time() - began
    again, elsewhere = digests(seeds), digests_elsewhere(seeds)
    differ = [o.seed for o in outcomes if {again.get(o.seed), elsewhere.get(o.seed)} != {o.digest}]
    _print_table(outcomes, differ)
    print(f"each judged in {1000 * spent_s / len(seeds):.0f} ms of processor time")
    faults = [(outcome.seed, fault) for outcome in outcomes for fault in outcome.faults]
    for seed, fault in faults:
        print(f"FAULT seed {seed}: {fault}")
    for seed in differ:
        print(f"FAULT seed {seed}: made again, here or in another process, the plan is another")
    return 1 if faults or differ else 0


def _print_table(outcomes: Sequence[Outcome], differ: Sequence[int]) -> None:
    planned = [o for o in outcomes if o.kept is not None]
    refused = Counter(size for o in outcomes for size in o.clashes)
    sizes = ", ".join(f"{n} of {size}" for size, n in sorted(refused.items()))
    seeds = [o.seed for o in outcomes]
    rows = [
        ("specs", f"{len(outcomes)} (seeds {seeds[0]} to {seeds[-1]})"),
        ("planned", f"{len(planned)}, {sum(o.demands > 0 for o in planned)} with combinations"),
        (
            "refused",
            f"{len(outcomes) - len(planned)}, {sum(o.miscounted for o in outcomes)} for sums",
        ),
        ("combinations that clash", f"{sizes}"),
        ("furthest pair, no demand near", _worst(planned, "pair")),
        ("furthest pair, beside demands", _worst(planned, "pair_beside")),
        ("furthest beginning, no demand", _worst(planned, "beginning")),
        ("furthest beginning, demanded", _worst(planned, "beginning_linked")),
        ("others when made again", str(len(differ))),
        ("faults", str(sum(len(o.faults) for o in outcomes))),
    ]
    for name, found in rows:
        print(f"{name:30}  {found}")


def _worst(planned: Sequence[Outcome], figure: str) -> str:
    """Return the worst of a figure, and the seed of it."""
    found = max((getattr(o.kept, figure), -o.seed) for o in planned)
    return f"{found[0]:.2f} images (seed {-found[1]})"


if __name__ == "__main__":
    sys.exit(main())
