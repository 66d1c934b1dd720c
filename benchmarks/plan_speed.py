"""How long plans take, and how much memory, from a thousand images to a hundred million.

    .venv/bin/python -m benchmarks.plan_speed [--counts 1000 538643 100000000]

Every size is planned in a process of its own, with the attributes that are always balanced.
Printed: processor seconds to plan and to cut into shards, the most memory beyond that of a small
plan made before, the median of a thousand cells asked for one by one at random places in
microseconds, and, up to a million images, seconds to go through all cells.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from statistics import median

from benchmarks.machine import machine_line
from hi5_common.domain.plan import ALGORITHM, Plan
from hi5_common.domain.seeding import factor_rng
from hi5_common.domain.spec import parse_spec

COUNTS = (1000, 10_000, 100_000, 538_643, 1_000_000, 10_000_000, 100_000_000)
ENUMERATED = 1_000_000
ASKED = 1000
FIRST = 100
"""Images of a plan that is made before anything counts."""


def main() -> None:
    """Plan every size in a process of its own."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(measured(asked.one, asked.seed)))
        return
    print(f"{machine_line()}; plan {ALGORITHM}, seed {asked.seed}")
    print("      images   plan s  shards s     MB  cell µs   all s")
    for count in asked.counts:
        command = [sys.executable, "-m", "benchmarks.plan_speed", "--one", str(count)]
        done = subprocess.run(
            [*command, "--seed", str(asked.seed)], capture_output=True, check=True, text=True
        )
        row = json.loads(done.stdout)
        whole = "" if row["all_s"] is None else f"{row['all_s']:6.1f}"
        print(
            f"{count:12,}  {row['plan_s']:7.2f}  {row['shards_s']:8.3f}  {row['mb']:5.0f}  "
            f"{row['cell_us']:7.1f}  {whole:>6}",
            flush=True,
        )


def measured(count: int, seed: int) -> dict[str, float | None]:
    """Plan one size in this process."""
    Plan.of(parse_spec({"count": FIRST, "seed": seed}))  # loads what planning needs
    before_mb = _peak_mb()
    spec = parse_spec({"count": count, "seed": seed})
    started = time.process_time()
    plan = Plan.of(spec)
    planned = time.process_time()
    plan.shards()
    cut = time.process_time()
    rng = factor_rng(seed, 0, "benchmark/cells")
    times = []
    for index in rng.integers(0, count, ASKED).tolist():
        moment = time.perf_counter()
        plan.cell(index)
        times.append(time.perf_counter() - moment)
    peak_mb = _peak_mb()
    all_s = None
    if count <= ENUMERATED:
        moment = time.process_time()
        for _ in plan.cells():
            pass
        all_s = time.process_time() - moment
    return {
        "plan_s": planned - started,
        "shards_s": cut - planned,
        "mb": peak_mb - before_mb,
        "cell_us": 1e6 * median(times),
        "all_s": all_s,
    }


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    main()
