"""Keeps compiled skin maps as picture files in the cache, one folder a hand and detail level."""

import hashlib
import logging
import shutil
import tempfile
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.family import load_family
from services.worker.hand.shape import HandShape
from services.worker.hand.skinmaps.maps import MAPS_VERSION, SkinMaps, skin_maps

LOG = logging.getLogger(__name__)

PIGMENT_FILE, MARKS_FILE, RELIEF_FILE, DORSUM_FILE = (
    "pigment.png",
    "marks.png",
    "relief.exr",
    "dorsum.npy",
)
SEAL_FILE = "sha256"
FASTEST_PNG = (cv2.IMWRITE_PNG_COMPRESSION, 1)


class MapLevel(IntEnum):
    """Side of the maps in pixels: 0.66, 0.33 and 0.16 mm of a man's hand to a texel."""

    COARSE = 512
    MEDIUM = 1024
    FINE = 2048


@dataclass(frozen=True, eq=False)
class SkinMapFiles:
    """Compiled maps on disk (see SkinMaps), and the dorsum's pigment (N, 6) f4."""

    pigment: Path
    marks: Path
    relief: Path
    dorsum: npt.NDArray[np.float32]


def load_skin_maps(gender: Gender, level: MapLevel, cache_dir: Path) -> SkinMapFiles:
    """Return the skin maps of a gender's average hand, compiled into the cache when missing.

    All shapes of a gender share them: shapes have the same topology and texture coordinates. The
    folder's name carries the hand's hash and the maps' version; damaged files are made anew.
    """
    model = load_family(gender, cache_dir).shaped(HandShape.average())
    name = f"skin-{gender}-{int(level)}-{MAPS_VERSION}-{model.content_hash[:24]}"
    folder = cache_dir / name
    if not _is_whole(folder):
        _write(folder, skin_maps(model, int(level)))
    return SkinMapFiles(
        folder / PIGMENT_FILE,
        folder / MARKS_FILE,
        folder / RELIEF_FILE,
        np.load(folder / DORSUM_FILE, allow_pickle=False),
    )


def _is_whole(folder: Path) -> bool:
    """Whether the folder is there and its files are what was written."""
    try:
        sealed = (folder / SEAL_FILE).read_text("utf-8")
        whole = sealed == _seal(folder)
    except FileNotFoundError:
        return False
    if not whole:
        LOG.warning("cached maps are damaged", extra={"action": "recompile", "path": str(folder)})
    return whole


def _seal(folder: Path) -> str:
    digest = hashlib.sha256()
    for name in (PIGMENT_FILE, MARKS_FILE, RELIEF_FILE, DORSUM_FILE):
        digest.update((folder / name).read_bytes())
    return digest.hexdigest()


def _write(folder: Path, maps: SkinMaps) -> None:
    """Write beside the place and rename, so that no reader sees half of the maps."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as beside:
        whole = Path(beside) / folder.name
        whole.mkdir()
        for name, picture in ((PIGMENT_FILE, maps.pigment), (MARKS_FILE, maps.marks)):
            bgra = np.ascontiguousarray(picture[..., [2, 1, 0, 3]])
            if not cv2.imwrite(str(whole / name), bgra, FASTEST_PNG):
                raise OSError(f"{whole / name} could not be written")
        _write_exr(whole / RELIEF_FILE, maps.relief_mm)
        np.save(whole / DORSUM_FILE, maps.dorsum, allow_pickle=False)
        (whole / SEAL_FILE).write_text(_seal(whole), "utf-8")
        if folder.exists():
            # Damaged, or just finished by another process, whose readers hold their files open.
            shutil.rmtree(folder, ignore_errors=True)
        try:
            whole.rename(folder)
        except OSError:
            if not _is_whole(folder):
                raise


def _write_exr(path: Path, relief_mm: npt.NDArray[np.float16]) -> None:
    import OpenEXR  # slow, and only needed where maps are compiled

    header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGBA": np.ascontiguousarray(relief_mm)}) as file:
        file.write(str(path))
