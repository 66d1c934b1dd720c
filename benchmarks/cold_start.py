"""Seconds from the start of a process to its first image, with an empty cache and with a full one.

    .venv/bin/python -m benchmarks.cold_start [--side 640] [--warm 2] [--places living_day studio]

Each row is a fresh process of `hi5 render` that makes one image; its cache folder is new and empty
(cold), then the one that was just filled (warm). living_day is a room that has to be baked, studio
a panorama that comes with bpy. The time is the wall clock's around the whole process, so Python's
start, bpy's import, compiled hands, skin maps, the bake and the written files are all in it. What
else runs on the machine is in it too: the load before and the processors' own seconds are printed
beside it. Reported, not bounded.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import yaml

from benchmarks.machine import machine_line


@dataclass(frozen=True)
class Start:
    """One process: wall-clock seconds, and the processors' seconds of it and its children."""

    wall_s: float
    cpu_s: float


def spec_text(place: str, side_px: int, seed: int) -> str:
    """Return the spec of one image in a place, as YAML."""
    image = {"width": side_px, "height": side_px}
    attributes = {"environment": [place], "gender": ["female"]}
    return yaml.safe_dump({"count": 1, "seed": seed, "image": image, "attributes": attributes})


def start(spec: Path, cache: Path, out: Path) -> Start:
    """Make one image in a process of its own. Raises CalledProcessError with what it said."""
    command = [sys.executable, "-m", "hi5_common.cli", "render", str(spec), "--out", str(out)]
    environment = {**os.environ, "HI5_CACHE_DIR": str(cache)}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    wall_s = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Start(wall_s, cpu_s)


def main() -> None:
    """Run the starts one after another and print a line for each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--side", type=int, default=640)
    parser.add_argument("--seed", type=int, default=7, help="of the one image")
    parser.add_argument("--warm", type=int, default=2)
    parser.add_argument("--places", nargs="+", default=["living_day", "studio"])
    asked = parser.parse_args()
    print(machine_line())
    print(f"{asked.side} px, seed {asked.seed}", flush=True)
    for place in asked.places:
        with tempfile.TemporaryDirectory(prefix="hi5-cold-") as folder:
            spec = Path(folder) / "spec.yaml"
            spec.write_text(spec_text(place, asked.side, asked.seed), "utf-8")
            for number in range(1 + asked.warm):
                name = f"warm {number}" if number else "cold"
                took = start(spec, Path(folder) / "cache", Path(folder) / f"out{number}")
                print(
                    f"{place:20} {name:8} {took.wall_s:6.1f} s   CPU {took.cpu_s:6.1f} s",
                    flush=True,
                )


if __name__ == "__main__":
    main()
