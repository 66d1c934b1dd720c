"""Measure how well MediaPipe Hands, trained on photographs, reads hi5's pictures.

    .venv/bin/python -m benchmarks.detector --count 400 --seed 1
    .venv/bin/python -m benchmarks.detector --images DIR

Plans a balanced dataset of --count images, renders those the protocol judges (640×640, whole hand
in frame, its box at least 200 px long, ordinary light; no augmentation), runs the detector at its
default thresholds and prints the figures. See README.md beside this file.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.detector.environment import HERE, ROOT, Detector, open_detector
from benchmarks.detector.pictures import IMAGES, benchmark_specs, read_labels, render_judged
from benchmarks.detector.protocol import is_judged
from benchmarks.detector.report import as_json, in_words
from benchmarks.detector.score import Finding, Judged
from benchmarks.detector.sheet import write_sheet
from hi5_common.domain.labels import ImageLabel
from hi5_common.version import hi5_version


def main() -> int:
    """Run the command; return its exit code."""
    asked = _parser().parse_args()
    detector = open_detector(ROOT / ".tools" / "detector")
    folders = asked.images or [asked.out or Path(tempfile.mkdtemp(prefix="hi5-detector-"))]
    made = "--images, of " + ", ".join(folder.name for folder in folders)
    if not asked.images:
        specs = benchmark_specs(asked.count, asked.seed, asked.paired_tones)
        render_judged(specs, folders[0], asked.threads)
        made = f"--count {asked.count} --seed {asked.seed}"
        made += " --paired-tones" if asked.paired_tones else ""
    images: list[Judged] = []
    version = ""
    for folder in folders:
        version, found = find_hands(detector, folder, list(filter(is_judged, read_labels(folder))))
        images += found
    machine = {
        "asked": made,
        "judged": len(images),
        "hi5": hi5_version(),
        "mediapipe": version,
        "bundle_sha256": detector.bundle_sha256,
        "python": platform.python_version(),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
    }
    sys.stdout.write("".join(f"{name:17}{value}\n" for name, value in machine.items()))
    sys.stdout.write(in_words(images))
    (folders[0] / "detector.json").write_text(json.dumps({**machine, **as_json(images)}, indent=1))
    write_sheet(folders[0] / "misses.png", images)
    sys.stdout.write(f"\nwrote detector.json and misses.png into {folders[0]}\n")
    sys.stdout.flush()
    return 0


def find_hands(
    detector: Detector, folder: Path, labels: Sequence[ImageLabel]
) -> tuple[str, list[Judged]]:
    """Run the detector over labelled pictures; return its version and what it found."""
    script, pictures = str(HERE / "mediapipe_hands.py"), folder / IMAGES
    names = [label.file_name for label in labels]
    answer = subprocess.run(
        [str(detector.python), script, str(detector.bundle), str(pictures), *names],
        check=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    document = json.loads(answer.stdout)
    found = document["findings"]
    return document["mediapipe"], [
        Judged(label, _finding(found[label.file_name]), pictures / label.file_name)
        for label in labels
    ]


def _finding(values: dict[str, object] | None) -> Finding | None:
    if values is None:
        return None
    points = np.array(values["points_px"], dtype=np.float64)
    return Finding(tuple((float(x), float(y)) for x, y in points), str(values["side"]))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.detector", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--count", type=int, default=120, help="images planned; about half judged")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--paired-tones", action="store_true", help="every judged scene once in each skin tone"
    )
    parser.add_argument("--threads", type=int, default=0, help="of the renderer; 0: all cores")
    parser.add_argument("--out", type=Path, help="new folder to render into; default: temporary")
    parser.add_argument(
        "--images", type=Path, nargs="+", help="judge these folders of hi5 render instead"
    )
    return parser


if __name__ == "__main__":
    code = main()
    sys.stderr.flush()
    os._exit(code)  # past Blender's own exit, which may crash after the work is done
