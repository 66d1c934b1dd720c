"""The nemesis's render child: it speaks the protocol, draws nothing and starts in milliseconds.

The dataset's name says how long an image takes: "nemesis 0.25" is seconds.
"""

import ctypes
import hashlib
import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.nemesis import pictures

TEMPLATE = "label.json"
"""Of all labels, in the cache folder: the child is told of no other place."""
_PR_SET_PDEATHSIG = 1


def main() -> None:
    """Make the images of the job on standard input."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    job = json.loads(sys.stdin.readline())
    template = (Path(job["cache_dir"]) / TEMPLATE).read_text("utf-8")
    seconds = float(job["spec"]["name"].split()[1])
    _say({"event": "ready"})
    for index in job["indices"]:
        time.sleep(seconds)
        _say(_made(job, template, index, seconds))
    _say({"event": "done", "images": len(job["indices"])})
    os._exit(0)


def _made(job: dict[str, Any], template: str, index: int, seconds: float) -> dict[str, Any]:
    seed = job["spec"]["seed"]
    image, label = pictures.picture(seed, index), pictures.label(template, seed, index)
    stem = Path(job["out_dir"]) / f"{index:09d}"
    stem.with_suffix(".jpg").write_bytes(image)
    stem.with_suffix(".json").write_bytes(label)
    return {
        "event": "image",
        "index": index,
        "image_sha256": hashlib.sha256(image).hexdigest(),
        "label_sha256": hashlib.sha256(label).hexdigest(),
        "image_bytes": len(image),
        "label_bytes": len(label),
        "seconds": seconds,
        "rss_mb": 50.0,
        "pid": os.getpid(),
    }


def _say(event: dict[str, Any]) -> None:
    os.write(3, json.dumps(event).encode() + b"\n")


if __name__ == "__main__":
    main()
