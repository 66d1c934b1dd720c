"""What a figure was measured on."""

import os
import platform
import time
from importlib.metadata import version


def machine_line() -> str:
    """Return what was measured on, and how fast it is just now, in one line."""
    return (
        f"Python {platform.python_version()}, bpy {version('bpy')}, hi5 {version('hi5')}, "
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.2f}, "
        f"ten million additions take {yardstick_s():.2f} s"
    )


def yardstick_s() -> float:
    """Return how long ten million additions take in Python: how fast this machine is just now."""
    began = time.perf_counter()
    total = 0
    for number in range(10_000_000):
        total += number
    return time.perf_counter() - began
