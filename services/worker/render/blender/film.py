"""From Blender's render buffer to an array, by way of an uncompressed file in memory."""

import os
from pathlib import Path

import bpy
import numpy as np
import numpy.typing as npt
import OpenEXR

from services.worker.render.errors import RenderFailed


class MemoryFile:
    """A file that Blender can open by its path, that is nowhere on a disk, and that cannot be
    left behind: it ends with the process, however that ends.
    """

    def __init__(self) -> None:
        self._descriptor = os.memfd_create("hi5-frame")
        self.path = Path(f"/proc/self/fd/{self._descriptor}")

    def clear(self) -> None:
        """Make the file empty."""
        os.ftruncate(self._descriptor, 0)

    def size_bytes(self) -> int:
        """Return how much has been written."""
        return os.fstat(self._descriptor).st_size


def shoot(scene: bpy.types.Scene, film: MemoryFile) -> npt.NDArray[np.float32]:
    """Render the scene; return its (H, W, 4) f4 linear, premultiplied pixels."""
    film.clear()
    scene.render.filepath = str(film.path)
    answer = bpy.ops.render.render(write_still=True)
    if answer != {"FINISHED"} or not film.size_bytes():
        raise RenderFailed(f"Blender answered {sorted(answer)} and wrote no frame.")
    with OpenEXR.File(str(film.path)) as file:
        return np.array(file.channels()["RGBA"].pixels, dtype=np.float32)
