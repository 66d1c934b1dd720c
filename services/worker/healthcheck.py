"""The healthcheck of long-running processes: `python -m services.worker.healthcheck worker`."""

import argparse
import sys

from hi5_common.settings import Settings
from services.worker.fleet.heartbeat import Heartbeat


def main(arguments: list[str]) -> int:
    """Return 0 if a worker (or keeper) on this machine did its duty lately, else say why not."""
    parser = argparse.ArgumentParser(prog="services.worker.healthcheck", description=__doc__)
    parser.add_argument("role", choices=("worker", "keeper"), nargs="?", default="worker")
    problem = Heartbeat(Settings().health_dir, parser.parse_args(arguments).role).problem()
    if problem:
        sys.stderr.write(f"{problem}\n")
    return 1 if problem else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
