"""Pixels of a panorama of unknown origin: decoded by a confined process, handed back as numbers."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from services.worker.places.bakery import import_paths
from services.worker.places.decoding import REFUSED
from services.worker.places.exr import F4
from services.worker.places.headers.size import PictureSize

TIMEOUT_S = 300.0
_MODULE = "services.worker.places.decoding"
_PIXEL_BYTES = 12
_LIBRARIES_BYTES = 2 << 30
"""Address space, mostly never touched, of Python, numpy and the two decoders."""
_COPIES = 5
"""How often the decoders and numpy hold the pixels at once, at most."""
_SAID_BYTES = 300


class NotDecoded(ValueError):
    """The decoder refused the file, broke, or was stopped."""


def decoded(path: Path, size: PictureSize, scratch: Path) -> F4:
    """Return the linear radiance (H, W, 3) f4 of a file whose header was checked.

    scratch: an empty folder for what the process writes. Raises NotDecoded with the reason.
    """
    out, said = scratch / "pixels.f4", scratch / "said"
    out_bytes = size.width_px * size.height_px * _PIXEL_BYTES
    memory_bytes = _LIBRARIES_BYTES + _COPIES * out_bytes + 2 * size.decoded_bytes
    arguments = [str(path), str(out), str(memory_bytes), str(out_bytes)]
    with said.open("wb") as stderr:
        try:
            done = subprocess.run(
                [sys.executable, "-B", "-s", "-m", _MODULE, *arguments],
                env=_environment(scratch),
                cwd=scratch,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=stderr,
                timeout=TIMEOUT_S,
                start_new_session=True,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise NotDecoded(f"it was not decoded in {TIMEOUT_S:g} s") from error
    if done.returncode != 0:
        raise NotDecoded(_reason(done.returncode, said))
    if not out.is_file() or out.stat().st_size != out_bytes:
        raise NotDecoded("its pixels are not as many as its header says")
    pixels = np.fromfile(out, "<f4").reshape(size.height_px, size.width_px, 3)
    out.unlink()
    if not np.isfinite(pixels).all():
        raise NotDecoded("it has pixels that are not numbers")
    return pixels


def _reason(code: int, said: Path) -> str:
    with said.open("rb") as file:
        text = file.read(1 << 16).decode("utf-8", "replace").strip()
    last = (text.splitlines() or [""])[-1][:_SAID_BYTES]
    if code == REFUSED:
        return last
    how = f"was stopped by signal {-code}" if code < 0 else f"ended with {code}"
    return f"its decoder {how}{': ' if last else ''}{last}"


def _environment(scratch: Path) -> dict[str, str]:
    """Return what the process may know: where to import from, and nothing of ours."""
    return {
        "PATH": os.defpath,
        "HOME": str(scratch),
        "TMPDIR": str(scratch),
        "LANG": "C.UTF-8",
        "PYTHONPATH": os.pathsep.join(import_paths()),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }
