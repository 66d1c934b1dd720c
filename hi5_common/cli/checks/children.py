"""What the render children of this machine's workers came to, from the health folder."""

import json
import platform
from typing import Any

from hi5_common.cli.checks.check import Check, CheckFailed
from hi5_common.settings import Settings

_REMEDY = (
    "Run workers where a process may take system calls from itself (seccomp: Docker's own profile"
    " allows it), or set HI5_CHILD_NETWORK=true to accept it."
)


def children_check(settings: Settings) -> Check:
    """Return the check of what the worker process that last ended a child wrote down."""
    return Check("render children", lambda: _children(settings), _REMEDY)


def _children(settings: Settings) -> str:
    pattern = f"children-{platform.node()}-*.json"
    ledgers = sorted(settings.health_dir.glob(pattern), key=lambda path: path.stat().st_mtime)
    if not ledgers:
        return "none has ended here yet"
    sums: dict[str, Any] = json.loads(ledgers[-1].read_text("utf-8"))
    network = str(sums["network"])
    if network.startswith("open") and not settings.child_network:
        raise CheckFailed(f"they can reach the network ({network})")
    ends = ", ".join(f"{count} {end}" for end, count in sorted(sums["ends"].items()))
    slope = sums["slope_mb_per_image"]
    grows = "" if slope is None else f", {slope:+.3f} MB an image"
    return (
        f"{sums['images']} images, {ends}; at most {sums['peak_mb']} MB{grows}; network {network}"
    )
