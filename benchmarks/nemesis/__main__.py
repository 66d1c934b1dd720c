"""How hi5 stands what fleets meet: faults without end on real processes, and who checks.

    .venv/bin/python -m benchmarks.nemesis --faults 2000 --shards 2500 [--seed 1] [--out FILE.json]
        [--folder FOLDER]

Starts Postgres, Valkey and SeaweedFS, the service, two keepers and three workers, submits datasets
without end and does one fault after the other (`schedule.py`: which, is a pure function of the
seed). Then it waits for rest, and compares history, rows and objects (`checker.py`). Printed: what
is lost, doubled, wrong, unfinished or left over; how long recovery took; what was rendered in vain.
The history and every process's log are in the folder, which is kept if it is named or if something
is wrong. Exits with 1 if something is wrong.
"""

import argparse
import json
import shutil
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.machine import machine_line
from benchmarks.nemesis.report import as_json, in_words, report
from benchmarks.nemesis.run import Options, carry_out


def main() -> int:
    """Do a run and print its figures."""
    asked = _parser().parse_args()
    folder = asked.folder or Path(tempfile.mkdtemp(prefix="hi5-nemesis-"))
    folder.mkdir(parents=True, exist_ok=True)
    options = Options(asked.seed, asked.faults, asked.shards, asked.workers)
    print(machine_line())
    print(f"seed {options.seed}; history and logs: {folder}", flush=True)
    began_s = time.monotonic()
    outcome = carry_out(
        options,
        folder,
        lambda line: print(f"{time.monotonic() - began_s:6.0f} s  {line}", flush=True),
    )
    figures = report(outcome)
    print(in_words(outcome, figures))
    if asked.out:
        asked.out.write_text(json.dumps(as_json(outcome, figures), indent=1) + "\n", "utf-8")
    wrong = sum(outcome.verdict.counts().values())
    if not wrong and asked.folder is None:
        shutil.rmtree(folder)
    return 1 if wrong else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--faults", type=int, default=2000)
    parser.add_argument("--shards", type=int, default=2500, help="at least")
    parser.add_argument("--seed", type=int, default=1, help="of the order of faults")
    parser.add_argument("--workers", type=int, default=3)
    parser.add_argument("--out", type=Path, help="write the figures as JSON")
    parser.add_argument("--folder", type=Path, help="for history and logs; kept")
    return parser


if __name__ == "__main__":
    sys.exit(main())
