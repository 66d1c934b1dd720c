"""The healthcheck of long-running processes: `python -m services.worker.healthcheck worker`."""

import argparse
import sys

from hi5_common.settings import Settings
from services.worker.fleet.heartbeat import Heartbeat


def main(arguments: list[str]) -> int:
    """Return 0 if a worker (or keeper) on this machine did its duty lately, else say why not.

    A worker's duty is to ask the database for work. One that hears no doorbells does so too: that
    is said, and is no illness.
    """
    parser = argparse.ArgumentParser(prog="services.worker.healthcheck", description=__doc__)
    parser.add_argument("role", choices=("worker", "keeper"), nargs="?", default="worker")
    role = parser.parse_args(arguments).role
    folder = Settings().health_dir
    problem = Heartbeat(folder, role).problem()
    if problem:
        sys.stderr.write(f"{problem}\n")
    elif role == "worker" and Heartbeat(folder, "listener").problem():
        sys.stdout.write("it works, but hears no doorbell: see to the broker\n")
    return 1 if problem else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
