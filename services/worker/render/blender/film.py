"""From Blender's render buffer to an array, by way of an uncompressed file in memory."""

import os
import tempfile
from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt
import OpenEXR

from services.worker.render.errors import RenderFailed

SHARED_MEMORY = Path("/dev/shm")  # noqa: S108  a folder in memory, only its speed is wanted


def frame_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a private folder for one process's frames, in memory where the system has that."""
    usable = SHARED_MEMORY.is_dir() and os.access(SHARED_MEMORY, os.W_OK)
    return tempfile.TemporaryDirectory(prefix="hi5-", dir=SHARED_MEMORY if usable else None)


def shoot(scene: bpy.types.Scene, path: Path) -> None:
    """Render the scene's frame into an EXR file at `path`."""
    scene.render.filepath = str(path)
    path.unlink(missing_ok=True)
    answer = bpy.ops.render.render(write_still=True)
    if answer != {"FINISHED"} or not path.is_file():
        raise RenderFailed(f"Blender answered {sorted(answer)} and wrote no frame.")


def read_rgba(path: Path) -> npt.NDArray[np.float32]:
    """Return the file's (H, W, 4) f4 linear, premultiplied pixels."""
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        return np.array(channels["RGBA"].pixels, dtype=np.float32)
