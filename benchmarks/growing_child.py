"""The render child, which takes MEGABYTES more of memory when told to: one file asks for it."""

import os
import threading
import time
from pathlib import Path

from services.worker import render_child

ASKED = "grow"
MEGABYTES = 2500
LOOK_S = 0.02


def grow_when_asked() -> None:
    """Wait for the file in the attempt's temporary folder, then hold on to memory for good."""
    path = Path(os.environ["HOME"]) / ASKED
    while not path.exists():
        time.sleep(LOOK_S)
    path.unlink()
    held = [b"\xff" * (50 << 20) for _ in range(MEGABYTES // 50)]
    time.sleep(3600 + len(held))


if __name__ == "__main__":
    threading.Thread(target=grow_when_asked, daemon=True).start()
    render_child.main()
