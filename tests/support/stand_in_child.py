"""A render child for tests that need no picture: it speaks the protocol and can misbehave.

Its fault is the name of the dataset, in words: "crash_once 2". Faults that must happen only once
leave a file named after them in the folder above the images.
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

from tests.unit.export.factories import label

PR_SET_PDEATHSIG = 1


def main() -> None:
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    job = json.loads(sys.stdin.readline())
    fault, argument = (*job["spec"]["name"].split(), "", "")[:2]
    out_dir = Path(job["out_dir"])
    if fault == "never_starts":
        sys.stderr.write("no GPU here\n")
        os._exit(3)
    _say({"event": "ready", "network": "unknown"})
    for index in job["indices"]:
        _misbehave(fault, argument, index, out_dir, job["draws"])
        if fault == "slow":
            time.sleep(float(argument))
        _say(_image(job, index, out_dir, fault))
    _say({"event": "done", "images": len(job["indices"])})
    os._exit(0)


def _misbehave(fault: str, argument: str, index: int, out_dir: Path, draws: dict[str, int]) -> None:
    if fault == "crash_everywhere":
        os.kill(os.getpid(), signal.SIGSEGV)
    if not argument.isdigit() or index != int(argument):
        return
    if fault.endswith("_once") and not _first_time(out_dir, fault):
        return
    match fault.removesuffix("_once"):
        case "crash" | "crash_always":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "crash_first_draw" if str(index) not in draws:
            os.kill(os.getpid(), signal.SIGSEGV)
        case "hang" | "wait":
            time.sleep(3600)
        case "grow":
            grown = bytearray(400_000_000)
            time.sleep(3600 + len(grown))
        case "nonsense":
            os.write(3, b"Blender 5.2.3 says hello\n")
            time.sleep(3600)
        case "full_for_tar":
            (out_dir.parent / "samples.tar").symlink_to("/dev/full")
        case kind:
            _report(kind, index)


def _report(kind: str, index: int) -> None:
    """Speak of a fault, if it is one to speak of."""
    match kind:
        case "refuse":
            _say({"event": "failed", "index": index, "fault": "refused_view", "detail": "none"})
        case "no_memory":
            _say({"event": "failed", "index": index, "fault": "out_of_memory", "detail": ""})
            time.sleep(3600)  # nobody is to wait for a child that could get no memory
        case "no_disk":
            _say({"event": "failed", "index": index, "fault": "disk_full", "detail": "full"})
        case "break":
            _say({"event": "broken", "fault": "missing_asset", "detail": "no hand"})
            os._exit(1)


def _first_time(out_dir: Path, fault: str) -> bool:
    mark = out_dir.parent / fault
    if mark.exists():
        return False
    mark.touch()
    return True


def _image(job: dict[str, Any], index: int, out_dir: Path, fault: str) -> dict[str, Any]:
    picture = f"picture {job['spec']['seed']} {index}".encode()
    text = label(index).model_dump_json().encode()
    (out_dir / f"{index:09d}.jpg").write_bytes(picture)
    (out_dir / f"{index:09d}.json").write_bytes(text)
    reported = text
    if fault == "lie_once" and _first_time(out_dir, "lie_once"):
        reported = b"something else"
    return {
        "event": "image",
        "index": index,
        "image_sha256": hashlib.sha256(picture).hexdigest(),
        "label_sha256": hashlib.sha256(reported).hexdigest(),
        "image_bytes": len(picture),
        "label_bytes": len(text),
        "seconds": 0.3 if fault == "slow" else 0.01,
        "rss_mb": 10_000.0 if fault == "fat" else 50.0,
        "pid": os.getpid(),
    }


def _say(event: dict[str, Any]) -> None:
    os.write(3, json.dumps(event).encode() + b"\n")


if __name__ == "__main__":
    main()
