"""Loads the hands of a gender: compiled once, then kept in a cache."""

import logging
import tempfile
import zipfile
import zlib
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hi5_common.domain.vocabulary import Gender
from services.worker.hand import asset
from services.worker.hand.builds import HandFamily, content_hash
from services.worker.hand.compile import compile_family
from services.worker.hand.model import COMPILER_VERSION

__all__ = ["HandFamily", "family_path", "load_family"]

LOG = logging.getLogger(__name__)


def load_family(gender: Gender, cache_dir: Path) -> HandFamily:
    """All hands of this gender, from the cache or compiled into it.

    The file's name carries the hash of the input files and the compiler's version; a file that
    cannot be read or does not match its own hash is compiled anew. Raises HandAssetMissing.
    """
    path = family_path(gender, cache_dir)
    cached = _read(path)
    if cached is not None:
        return cached
    family = compile_family(asset.asset_folder(), gender)
    _write(path, family)
    return family


def family_path(gender: Gender, cache_dir: Path) -> Path:
    """Where the cache keeps the hands of a gender."""
    key = asset.input_hash(asset.asset_folder(), gender)[:24]
    return cache_dir / f"hand-{gender}-{COMPILER_VERSION}-{key}.npz"


def _read(path: Path) -> HandFamily | None:
    """The cached family, or None when there is none or it is damaged."""
    try:
        # Opened here: np.load leaves its file open when the archive is damaged.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as filed:
            values = _restored({name: filed[name] for name in filed.files})
            written = str(filed["content_hash"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        LOG.warning("cached hand is damaged", extra={"action": "recompile", "path": str(path)})
        return None
    family = HandFamily(**values, content_hash=written)
    return family if content_hash(values) == written else None


def _restored(filed: dict[str, npt.NDArray[Any]]) -> dict[str, Any]:
    names = [field.name for field in fields(HandFamily) if field.name != "content_hash"]
    values: dict[str, Any] = {name: filed[name] for name in names}
    values["gender"] = Gender(str(values["gender"]))
    return values


def _write(path: Path, family: HandFamily) -> None:
    """Write beside the place and rename, so that no reader sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {field.name: np.asarray(getattr(family, field.name)) for field in fields(family)}
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        whole = Path(folder) / path.name
        np.savez(whole, allow_pickle=False, **arrays)
        whole.replace(path)
