"""Where a frame's time goes inside Cycles: from the words it says of its own progress."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import bpy

PHASES = (
    ("Synchronizing", "sync"),
    ("BVH", "bvh"),
    ("Importance map", "importance_map"),
    ("Computing tree", "importance_map"),
    ("Sample", "sample"),
    ("Denoising", "sample"),
    ("Finished", "read_back"),
    ("Updating", "sync"),
    ("Waiting", "sync"),
    ("Initializing", "sync"),
)
"""The first that occurs in a message names what goes on from then until the next message."""
BEFORE = "enter"


@contextmanager
def timeline() -> Iterator[dict[str, float]]:
    """Give a dictionary that holds, after the block, the seconds of each phase of its renders.

    What passes before Cycles first speaks is `enter`. Denoising happens while it says Sample.
    """
    seconds: dict[str, float] = {}
    since, current = time.perf_counter(), BEFORE

    def heard(*words: object) -> None:
        said = next((word for word in words if isinstance(word, str)), "")
        phase = next((name for part, name in PHASES if part in said), None)
        if phase is not None:
            turn(phase)

    def turn(phase: str) -> None:
        nonlocal since, current
        now = time.perf_counter()
        seconds[current] = seconds.get(current, 0.0) + now - since
        since, current = now, phase

    bpy.app.handlers.render_stats.append(heard)
    try:
        yield seconds
    finally:
        bpy.app.handlers.render_stats.remove(heard)
        turn(BEFORE)
