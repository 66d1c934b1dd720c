"""Keeps compiled skin maps as arrays in the cache, one folder a hand and detail level."""

import hashlib
import logging
import shutil
import tempfile
from enum import IntEnum
from pathlib import Path

import numpy as np

from hi5_common.domain.vocabulary import Gender
from services.worker.hand.family import load_family
from services.worker.hand.shape import HandShape
from services.worker.hand.skinmaps.maps import MAPS_VERSION, SkinMaps, skin_maps

LOG = logging.getLogger(__name__)

MARKS_FILE, HEIGHTS_FILE, DORSUM_FILE = "marks.npy", "heights.npy", "dorsum.npy"
FILES = (MARKS_FILE, HEIGHTS_FILE, DORSUM_FILE)
SEAL_FILE = "sha256"


class MapLevel(IntEnum):
    """Side of the maps in pixels: 1.3, 0.66, 0.33 and 0.16 mm of a man's hand to a texel."""

    TINY = 256
    COARSE = 512
    MEDIUM = 1024
    FINE = 2048


def load_skin_maps(gender: Gender, level: MapLevel, cache_dir: Path) -> SkinMaps:
    """Return the skin maps of a gender's average hand, compiled into the cache when missing.

    All shapes of a gender share them: shapes have the same topology and texture coordinates. The
    folder's name carries the hand's hash and the maps' version; damaged files are made anew.
    """
    model = load_family(gender, cache_dir).shaped(HandShape.average())
    name = f"skin-{gender}-{int(level)}-{MAPS_VERSION}-{model.content_hash[:24]}"
    folder = cache_dir / name
    if not _is_whole(folder):
        _write(folder, skin_maps(model, int(level)))
    # Mapped into memory: what processes share is held once.
    marks, heights, dorsum = (
        np.load(folder / file, mmap_mode="r", allow_pickle=False) for file in FILES
    )
    return SkinMaps(marks, heights, dorsum)


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
    for name in FILES:
        digest.update((folder / name).read_bytes())
    return digest.hexdigest()


def _write(folder: Path, maps: SkinMaps) -> None:
    """Write beside the place and rename, so that no reader sees half of the maps."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as beside:
        whole = Path(beside) / folder.name
        whole.mkdir()
        np.save(whole / MARKS_FILE, maps.marks, allow_pickle=False)
        np.save(whole / HEIGHTS_FILE, maps.heights, allow_pickle=False)
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
