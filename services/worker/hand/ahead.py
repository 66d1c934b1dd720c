"""Compiles a gender's hands in a process of its own, while Blender is loaded in this one.

    python -m services.worker.hand.ahead GENDER CACHE_DIR

Loading bpy takes seconds and holds the interpreter all the while, so a thread would gain nothing.
"""

import subprocess
import sys
from pathlib import Path

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.asset import HandAssetMissing
from services.worker.hand.family import family_path, load_family


def compile_ahead(gender: Gender, cache_dir: Path) -> subprocess.Popen[bytes] | None:
    """Begin to compile what the cache does not have yet; None when there is nothing to do.

    Whoever needs the hands waits for the process and loads them: what it did not get done, it does.
    """
    try:
        if family_path(gender, cache_dir).is_file():
            return None
    except HandAssetMissing:  # who needs the hands says so, and why there is no image
        return None
    command = [sys.executable, "-m", "services.worker.hand.ahead", gender.value, str(cache_dir)]
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        close_fds=True,
    )


if __name__ == "__main__":
    load_family(Gender(sys.argv[1]), Path(sys.argv[2]))
