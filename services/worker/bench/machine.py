"""What a figure was measured on."""

import os
import platform
from importlib.metadata import version
from pathlib import Path


def machine(threads: int) -> dict[str, object]:
    """Return what was measured on."""
    words = [
        line.split(":", 1)[1].strip()
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        if line.startswith("model name")
    ]
    return {
        "processor": words[0] if words else platform.processor(),
        "cores": os.cpu_count(),
        "threads": threads,
        "python": platform.python_version(),
        "bpy": version("bpy"),
        "hi5": version("hi5"),
        "load": os.getloadavg()[0],
    }
